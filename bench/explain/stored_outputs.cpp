// SPDX-License-Identifier: Apache-2.0
#include "explain/stored_outputs.hpp"

#include <algorithm>
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

/// The place of the chain or task of this name.
std::uint32_t place_of(const std::string& name, const auto& all, const char* what) {
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const auto& one : all) names.push_back(one.name);
  const auto place = std::ranges::find(names, name);
  if (place != names.end()) return static_cast<std::uint32_t>(place - names.begin());
  throw program::UsageError(
      program::concat("--", what, ": there is no ", what, " ", name, "; ", suggest(name, names)));
}

}  // namespace

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             std::optional<std::uint32_t> repetition)
    : run_(run),
      stored_(run.check([&] { return setup::stored_system(run); })),
      executor_(executor_of(run, executor)),
      repetition_(repetition),
      subject_{stored_.tasks.set, executor_, "", "", 0} {
  if (!std::ranges::equal(run.tasks().tasks, stored_.tasks.set.tasks, {}, &Task::name, &Task::name))
    run.fail("its tasks are not those of its graph, which has changed since; run it again");
  if (repetition_) static_cast<void>(run.run(executor_, *repetition_));  // throws if it did not run
  run.check([&] {
    system_.emplace(stored_.executor(executor_), stored_.graph, stored_.tasks, run.record().kind,
                    std::max(1U, run.record().cores()));
  });
}

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             const Options& options)
    : StoredOutputs(run, executor, options.repetition) {
  choose_target(options);
  if (target_.chain) {
    read_chains();
  } else {
    for_each_response([&](TaskId task, const Output& output) {
      if (task == target_.task) outputs_.push_back(output);
    });
  }
  if (outputs_.empty()) {
    run.fail(program::concat(
        "it has no ", target_.chain ? "output of " + subject_.chain : "counted job of " + subject_.task,
        " under ", executor_, "; take another executor or repetition, or a longer run"));
  }
}

void StoredOutputs::choose_target(const Options& options) {
  subject_.task = options.task;
  if (!options.task.empty()) {
    target_.task = place_of(options.task, stored_.tasks.set.tasks, "task");
    return;
  }
  const std::vector<Chain>& chains = stored_.graph.chains;
  if (chains.empty()) run_.fail("its graph has no chain; name a task with --task");
  subject_.chain = options.chain.empty() ? chains.front().name : options.chain;
  target_.chain = place_of(subject_.chain, chains, "chain");
}

bool StoredOutputs::selected(std::string_view executor, std::uint32_t repetition) const {
  return executor == executor_ && (!repetition_ || repetition == *repetition_);
}

void StoredOutputs::read_chains() {
  run_.for_each_chain([&](const ChainRow& row) {
    if (run_.chains()[row.record.chain] != subject_.chain || !selected(row.executor, row.repetition)) return;
    if (row.record.hot_path_latency < Duration{}) {
      ++younger_;
      return;
    }
    outputs_.push_back({row.repetition, row.record.sequence, row.record.hot_path_latency, row.record.sink});
  });
}

void StoredOutputs::for_each_response(const std::function<void(TaskId, const Output&)>& use) const {
  results::for_each_record(run_, [&](const JobRow& row) {
    const JobRecord& r = row.record;
    if (!selected(row.executor, row.repetition) || !results::counts(r, Time{} + run_.warm_up())) return;
    use(r.job.task, {row.repetition, r.job.sequence, results::response_time(r), kNoTask});
  });
}

void StoredOutputs::explain(const std::vector<Output>& outputs, const Explainer::Use& use) {
  std::deque<Explainer> explainers;  // never moves them
  explainers.emplace_back(*system_, target_, outputs, use);
  pass_jobs(explainers);
  subject_.missing = explainers.front().missing() + younger_;
  if (explainers.front().missing() == outputs.size()) run_.fail("its jobs.csv lacks the jobs of its outputs");
}

void StoredOutputs::explain_tasks(const results::StoredRun& run, const std::string& executor,
                                  std::size_t most,
                                  const std::function<void(TaskId, const Explanation&)>& use) {
  const StoredOutputs all(run, executor, std::nullopt);
  std::vector<std::vector<Output>> slowest(all.stored_.tasks.set.size());
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
    explainers.emplace_back(*all.system_, Target{std::nullopt, task}, std::move(slowest[task]),
                            [&use, task](const Explanation& e) { use(task, e); });
  }
  if (!explainers.empty()) all.pass_jobs(explainers);
}

void StoredOutputs::pass_jobs(std::deque<Explainer>& explainers) const {
  std::unique_ptr<ExecutionTimes> times;  // of a simulation; nullptr: not known
  const bool known = stored_.simulated && parse<ExecutionTimeModel>(stored_.execution_times);
  std::optional<std::uint32_t> current;
  results::for_each_record(run_, [&](const JobRow& row) {
    if (!selected(row.executor, row.repetition)) return;
    if (current != row.repetition) {
      if (current) std::ranges::for_each(explainers, &Explainer::end);
      const std::uint64_t seed = stored_.options.seed + row.repetition;
      if (known) times = simulated::execution_times_of(stored_.graph, stored_.tasks, seed);
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
