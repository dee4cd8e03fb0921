// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <utility>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/suggestion.hpp"
#include "program/errors.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"
#include "results/stored_summary.hpp"

namespace hotpath::explain {

namespace {

using program::concat, program::UsageError;

/// The executor of the run with this label, or the first.
std::string executor_of(const results::StoredRun& run, const std::string& label) {
  if (run.executors().empty()) run.fail("it has no executors");
  if (label.empty()) return run.executors().front();
  if (std::ranges::count(run.executors(), label) == 0)
    run.fail(concat("it has no executor ", label, "; ", suggest(label, run.executors())));
  return label;
}

/// The place of the chain or task of this name.
std::uint32_t place_of(const std::string& name, const auto& all, const char* what) {
  std::vector<std::string> names(all.size());
  std::ranges::transform(all, names.begin(), [](const auto& one) { return one.name; });
  const auto place = std::ranges::find(names, name);
  if (place != names.end()) return static_cast<std::uint32_t>(place - names.begin());
  throw UsageError(concat("--", what, ": there is no ", what, " ", name, "; ", suggest(name, names)));
}

/// Prints to standard output.
void show(Report report, bool as_json) {
  if (!as_json) {
    std::cout << program::joined(report.sentences, "\n") << "\n\n" << report.text;
  } else {
    report.data["sentences"] = report.sentences;
    program::data_output() << report.data.dump(2) << "\n";
  }
}

Output chosen(const Options& options, const std::vector<Output>& outputs) {
  if (!options.sequence)
    return sorted_by_latency(outputs)[nearest_rank(outputs.size(), options.quantile.value_or(1))];
  const auto output = std::ranges::find(outputs, *options.sequence, &Output::sequence);
  if (output != outputs.end()) return *output;
  throw UsageError(concat("--sequence: no counted output has sequence ", *options.sequence,
                          "; the first has ", outputs.front().sequence, ", the last ",
                          outputs.back().sequence));
}

Overview overview_of(StoredOutputs& stored) {
  Overview overview(stored.outputs());
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { overview.add(explanation); });
  return overview;
}

Totals totals_of(const SimulatedRun& run, std::uint32_t chain, Latency latency) {
  const simulated::Plan& plan = run.plan;
  const System system(plan.executor, plan.graph, plan.tasks, results::RunKind::simulated,
                      plan.graph.platform.cores);
  std::vector<Output> outputs;
  for (const ChainRecord& record : run.trace.chains) {
    const auto value = record.latency(latency);
    if (record.chain == chain && value >= Duration{})
      outputs.push_back({0, record.sequence, *value, record.sink});
  }
  Totals totals;
  Explainer explainer(system, chain, latency, std::move(outputs), &plan.times,
                      [&](const Explanation& explanation) { totals.add(explanation); });
  for (const JobRecord& record : run.trace.jobs) explainer.add(record);
  explainer.end();
  return totals;
}

}  // namespace

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             const Options& options)
    : run_(run),
      stored_(run.check([&] { return setup::stored_system(run); })),
      repetition_(options.repetition),
      subject_{stored_.tasks.set, executor_of(run, executor), options.task} {
  if (!std::ranges::equal(run.tasks().tasks, stored_.tasks.set.tasks, {}, &Task::name, &Task::name))
    run.fail("its tasks are not those of its graph, which has changed since; run it again");
  if (repetition_) static_cast<void>(run.run(subject_.executor, *repetition_));  // throws if it did not run
  run.check([&] {
    system_.emplace(stored_.executor(subject_.executor), stored_.graph, stored_.tasks, run.record().kind,
                    std::max(1U, run.record().cores()));
  });
  for (const auto* sentences : {&run.record().warnings, &run.record().failures}) {
    std::ranges::copy_if(*sentences, std::back_inserter(subject_.warnings), [&](const std::string& sentence) {
      return sentence.starts_with(subject_.executor + " ") || sentence.starts_with(subject_.executor + ": ");
    });
  }
  options.slowest > 0 || !options.task.empty() ? find_jobs(options) : find_outputs(options);
  if (!outputs_.empty() || options.slowest > 0) return;
  const std::string why = program::joined(subject_.warnings, " ");
  run.fail(concat("it has no ", chain_ ? "output of " : "counted job of ", subject_.name, " under ",
                  subject_.executor, "; take another executor or repetition, or a longer run",
                  why.empty() ? "" : ": " + why));
}

void StoredOutputs::find_outputs(const Options& options) {
  const std::vector<Chain>& chains = stored_.graph.chains;
  if (chains.empty()) run_.fail("its graph has no chain; name a task with --task");
  subject_.latency = options.hot_path ? Latency::hot_path : Latency::age;
  subject_.name = options.chain.empty() ? chains.front().name : options.chain;
  chain_ = place_of(subject_.name, chains, "chain");
  run_.for_each_chain([&](const ChainRow& row) {
    if (run_.chains()[row.record.chain] != subject_.name || !selected(row)) return;
    ++counted_[row.repetition];
    const auto latency = row.record.latency(subject_.latency);
    if (latency >= Duration{})
      outputs_.push_back({row.repetition, row.record.sequence, *latency, row.record.sink});
    else
      ++left_out_;
  });
}

void StoredOutputs::find_jobs(const Options& options) {
  subject_.latency = Latency::response;
  const std::vector<Task>& tasks = stored_.tasks.set.tasks;
  const std::optional<TaskId> task =
      options.slowest > 0 ? std::nullopt : std::optional(place_of(options.task, tasks, "task"));
  std::vector<std::vector<Output>> by_task(tasks.size());
  const auto keep_slowest = [&](std::vector<Output>& outputs) {
    std::ranges::stable_sort(outputs, std::greater<>(), &Output::latency);
    outputs.resize(std::min(outputs.size(), options.slowest));
  };
  results::for_each_record(run_, [&](const JobRow& row) {
    const JobRecord& r = row.record;
    if (!selected(row) || !results::counts(r, Time{} + run_.warm_up())) return;
    if (task && r.job.task != *task) return;
    ++counted_[row.repetition];
    std::vector<Output>& outputs = by_task[r.job.task];
    outputs.push_back({row.repetition, r.job.sequence, r.response_time(), r.job.task});
    if (options.slowest > 0 && outputs.size() >= 4 * options.slowest) keep_slowest(outputs);
  });
  for (std::vector<Output>& outputs : by_task) {
    if (options.slowest > 0) keep_slowest(outputs);
    outputs_.insert(outputs_.end(), outputs.begin(), outputs.end());
  }
}

std::size_t StoredOutputs::fewer_than(const StoredOutputs& other) const {
  if (run_.warm_up() != other.run_.warm_up() || run_.length() != other.run_.length()) return 0;
  std::map<std::uint32_t, std::size_t> own = counted_, theirs = other.counted_;
  std::size_t fewer = 0;
  for (const results::RepetitionRecord& r : run_.record().runs)
    if (selected(r)) fewer += theirs[r.repetition] - std::min(theirs[r.repetition], own[r.repetition]);
  return fewer;
}

void StoredOutputs::explain(const std::vector<Output>& outputs, const Explainer::Use& use) {
  std::map<std::uint32_t, std::vector<Output>> by_repetition;
  for (const Output& output : outputs) by_repetition[output.repetition].push_back(output);
  std::size_t explained = 0;
  std::unique_ptr<ExecutionTimes> times;  // of a simulation; nullptr: not known
  const bool known = stored_.times && stored_.times->model;
  std::optional<std::uint32_t> repetition;
  std::optional<Explainer> explainer;
  results::for_each_record(run_, [&](const JobRow& row) {
    if (!selected(row)) return;
    if (repetition != row.repetition) {
      if (explainer) explainer->end();
      repetition = row.repetition;
      const std::uint64_t seed = stored_.options.seed + row.repetition;
      if (known) times = simulated::execution_times_of(stored_.graph, stored_.tasks, seed);
      explainer.emplace(*system_, chain_, subject_.latency, by_repetition[row.repetition], times.get(),
                        [&](const Explanation& e) {
                          ++explained;
                          use(e);
                        });
    }
    if (row.record.started() && row.record.start < explainer->last_start()) {
      throw InputError((run_.folder() / "jobs.csv").string(), static_cast<std::int64_t>(row.line),
                       "the job is not in the order of starts", "keep the order of the rows");
    }
    explainer->add(row.record);
  });
  if (explainer) explainer->end();
  subject_.missing = outputs.size() - explained + left_out_;
  if (explained == 0 && !outputs.empty()) run_.fail("its jobs.csv lacks the jobs of its outputs");
}

void explain(const Options& options) {
  const bool one = options.worst || options.quantile || options.sequence;
  const bool compares = options.executors.size() == 2 || !options.other.empty();
  if (options.executors.size() > 2) throw UsageError("--executors: give one executor, or two to compare");
  if (compares && one) {
    throw UsageError(
        "explain: a comparison covers all outputs; leave out --worst, --quantile and --sequence");
  }
  const results::StoredRun run(options.run, "explain");
  const std::vector<std::string>& names = options.executors;
  StoredOutputs stored(run, names.empty() ? "" : names.front(), options);
  if (!compares && one)
    return stored.explain({chosen(options, stored.outputs())},
                          [&](const Explanation& e) { show(report(stored.subject(), e), options.json); });
  if (!compares) {
    const Overview overview = overview_of(stored);  // counts what is missing, too
    return show(report(stored.subject(), overview), options.json);
  }
  if (options.other.empty() && names.front() == names.back())
    throw UsageError("--executors: the two executors are the same");
  const results::StoredRun other(options.other.empty() ? options.run : options.other, "explain");
  StoredOutputs others(other, names.empty() ? "" : names.back(), options);
  if (!std::ranges::equal(stored.subject().set.tasks, others.subject().set.tasks, {}, &Task::name,
                          &Task::name))
    throw UsageError("explain: the runs have different tasks; compare runs of one graph");
  const Totals of_a = overview_of(stored).all, of_b = overview_of(others).all;
  Subject a = stored.subject(), b = others.subject();
  if (a.executor == b.executor) {
    a.executor += " in " + options.run;
    b.executor += " in " + options.other;
  }
  a.fewer = stored.fewer_than(others);
  b.fewer = others.fewer_than(stored);
  show(report(a, of_a, b, of_b), options.json);
}

std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b, std::uint32_t chain,
                                    Latency latency) {
  const Totals of_a = totals_of(a, chain, latency), of_b = totals_of(b, chain, latency);
  if (of_a.outputs == 0 || of_b.outputs == 0) return {};
  const auto subject = [&](const simulated::Plan& plan, const Totals& own, const Totals& other) {
    return Subject{.set = plan.tasks.set,
                   .executor = plan.executor.label,
                   .name = plan.graph.chains[chain].name,
                   .latency = latency,
                   .fewer = other.outputs - std::min(own.outputs, other.outputs)};
  };
  return report(subject(a.plan, of_a, of_b), of_a, subject(b.plan, of_b, of_a), of_b).sentences;
}

}  // namespace hotpath::explain
