// SPDX-License-Identifier: Apache-2.0
#include "explain/stored_outputs.hpp"

#include <algorithm>
#include <deque>
#include <fstream>
#include <functional>
#include <utility>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/suggestion.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"
#include "results/stored_summary.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::explain {

namespace {

/// The executor of the run with this label, or the first.
std::string executor_of(const results::StoredRun& run, const std::string& label) {
  if (run.executors().empty()) run.fail("it has no executors");
  if (label.empty()) return run.executors().front();
  if (std::ranges::count(run.executors(), label) == 0) {
    run.fail(program::concat("it has no executor ", label, "; ", suggest(label, run.executors())));
  }
  return label;
}

void check_tasks(const results::StoredRun& run, const TaskSet& graph) {
  const auto name = [](const Task& task) { return task.name; };
  if (std::ranges::equal(run.tasks().tasks, graph.tasks, {}, name, name)) return;
  run.fail("its tasks are not those of its graph, which has changed since; run it again");
}

}  // namespace

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             std::optional<std::uint32_t> repetition)
    : run_(run),
      system_(run.check([&] { return setup::stored_system(run); })),
      executor_(executor_of(run, executor)),
      repetition_(repetition),
      subject_{system_.tasks.set, executor_, "", "", 0} {
  check_tasks(run, system_.tasks.set);
  if (repetition_) static_cast<void>(run.run(executor_, *repetition_));  // throws if it did not run
  explained_.emplace(run.check([&] {
    return System(system_.executor(executor_), system_.graph, system_.tasks, run.record().kind,
                  std::max(1U, run.record().cores()));
  }));
}

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             const Options& options)
    : StoredOutputs(run, executor, options.repetition) {
  choose_target(options);
  target_.chain ? read_chains() : read_responses();
  if (outputs_.empty()) {
    run.fail(program::concat(
        "it has no ", target_.chain ? "output of " + subject_.chain : "counted job of " + subject_.task,
        " under ", executor_, "; take another executor or repetition, or a longer run"));
  }
}

void StoredOutputs::choose_target(const Options& options) {
  if (!options.task.empty()) {
    const auto& tasks = system_.tasks.set.tasks;
    const auto task = std::ranges::find(tasks, options.task, &Task::name);
    if (task == tasks.end()) {
      std::vector<std::string> names;
      names.reserve(tasks.size());
      for (const Task& t : tasks) names.push_back(t.name);
      throw program::UsageError(
          program::concat("--task: there is no task ", options.task, "; ", suggest(options.task, names)));
    }
    target_.task = static_cast<TaskId>(task - tasks.begin());
    subject_.task = options.task;
    return;
  }
  if (system_.graph.chains.empty()) run_.fail("its graph has no chain; name a task with --task");
  std::vector<std::string> names;
  for (const Chain& chain : system_.graph.chains) names.push_back(chain.name);
  subject_.chain = options.chain.empty() ? names.front() : options.chain;
  const auto chain = std::ranges::find(names, subject_.chain);
  if (chain == names.end()) {
    throw program::UsageError(
        program::concat("--chain: there is no chain ", options.chain, "; ", suggest(options.chain, names)));
  }
  target_.chain = static_cast<std::uint32_t>(chain - names.begin());
}

bool StoredOutputs::selected(std::string_view executor, std::uint32_t repetition) const {
  return executor == executor_ && (!repetition_ || repetition == *repetition_);
}

void StoredOutputs::read_chains() {
  std::ifstream in = run_.open("chains.csv");
  const std::string file = (run_.folder() / "chains.csv").string();
  for_each_chain(in, file, [&](const ChainRow& row) {
    if (row.chain != subject_.chain || !selected(row.executor, row.repetition)) return;
    if (row.record.hot_path_latency < Duration{}) {
      ++younger_;
      return;
    }
    const auto sink = std::ranges::find(system_.tasks.set.tasks, row.sink_task, &Task::name);
    const bool known = sink != system_.tasks.set.tasks.end();
    outputs_.push_back({row.repetition, row.record.sequence, row.record.hot_path_latency,
                        known ? static_cast<TaskId>(sink - system_.tasks.set.tasks.begin()) : kNoTask});
  });
}

void StoredOutputs::read_responses() {
  for_each_response([&](TaskId task, const Output& output) {
    if (task == target_.task) outputs_.push_back(output);
  });
}

void StoredOutputs::for_each_response(const std::function<void(TaskId, const Output&)>& use) const {
  results::for_each_record(run_, [&](const JobRow& row) {
    const JobRecord& r = row.record;
    if (!selected(row.executor, row.repetition) || !results::counts(r, Time{} + run_.warm_up())) return;
    use(r.job.task, {row.repetition, r.job.sequence, results::response_time(r), kNoTask});
  });
}

std::unique_ptr<ExecutionTimes> StoredOutputs::execution_times(std::uint32_t repetition) const {
  if (!system_.simulated || !parse<ExecutionTimeModel>(system_.execution_times)) return nullptr;
  return simulated::execution_times_of(system_.graph, system_.tasks, system_.options.seed + repetition);
}

void StoredOutputs::explain(const std::vector<Output>& outputs, const Explainer::Use& use) {
  std::deque<Explainer> explainers;  // never moves them
  explainers.emplace_back(*explained_, target_, outputs, "explain " + run_.folder().string(), use);
  pass_jobs(explainers);
  subject_.missing = explainers.front().missing() + younger_;
  if (explainers.front().missing() == outputs.size()) run_.fail("its jobs.csv lacks the jobs of its outputs");
}

void StoredOutputs::explain_tasks(const results::StoredRun& run, const std::string& executor,
                                  std::size_t most,
                                  const std::function<void(TaskId, const Explanation&)>& use) {
  const StoredOutputs all(run, executor, std::nullopt);
  std::vector<std::vector<Output>> slowest(all.system_.tasks.set.size());
  const auto keep = [most](std::vector<Output>& outputs) {
    std::ranges::stable_sort(outputs, std::greater<>(), &Output::latency);
    outputs.resize(std::min(outputs.size(), most));
  };
  all.for_each_response([&](TaskId task, const Output& output) {
    slowest[task].push_back(output);
    if (slowest[task].size() >= 4 * most) keep(slowest[task]);
  });
  std::deque<Explainer> explainers;  // never moves them
  for (TaskId task = 0; task < slowest.size(); ++task) {
    if (slowest[task].empty()) continue;
    keep(slowest[task]);
    explainers.emplace_back(*all.explained_, Target{std::nullopt, task}, std::move(slowest[task]),
                            "explain " + run.folder().string(),
                            [&use, task](const Explanation& e) { use(task, e); });
  }
  if (!explainers.empty()) all.pass_jobs(explainers);
}

void StoredOutputs::pass_jobs(std::deque<Explainer>& explainers) const {
  std::unique_ptr<ExecutionTimes> times;
  std::optional<std::uint32_t> current;
  results::for_each_record(run_, [&](const JobRow& row) {
    if (!selected(row.executor, row.repetition)) return;
    if (current != row.repetition) {
      if (current) std::ranges::for_each(explainers, &Explainer::end);
      times = execution_times(row.repetition);
      for (Explainer& explainer : explainers) explainer.begin(row.repetition, times.get());
      current = row.repetition;
    }
    if (started(row.record) && row.record.start < explainers.front().last_start()) {
      throw InputError((run_.folder() / "jobs.csv").string(), static_cast<std::int64_t>(row.line),
                       "the job is not in the order of starts", "keep the order of the rows");
    }
    for (Explainer& explainer : explainers) explainer.add(row.record);
  });
  if (current) std::ranges::for_each(explainers, &Explainer::end);
}

}  // namespace hotpath::explain
