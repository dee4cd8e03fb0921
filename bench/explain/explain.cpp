// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
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
  if (std::ranges::count(run.executors(), label) == 0) {
    run.fail(concat("it has no executor ", label, "; ", suggest(label, run.executors())));
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
  throw UsageError(concat("--", what, ": there is no ", what, " ", name, "; ", suggest(name, names)));
}

/// Prints to standard output.
void show(const Report& report, bool as_json) {
  if (!as_json) {
    std::cout << program::joined(report.sentences, "\n") << "\n\n" << report.text;
    return;
  }
  nlohmann::json data = report.data;
  data["sentences"] = report.sentences;
  program::data_output() << data.dump(2) << "\n";
}

Output chosen(const Options& options, const std::vector<Output>& outputs) {
  if (!options.sequence) return at_quantile(sorted_by_latency(outputs), options.quantile.value_or(1));
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

void explain_difference(const Options& options, StoredOutputs& a, StoredOutputs& b) {
  if (!std::ranges::equal(a.subject().set.tasks, b.subject().set.tasks, {}, &Task::name, &Task::name))
    throw UsageError("explain: the runs have different tasks; compare runs of one graph");
  const Totals of_a = overview_of(a).all, of_b = overview_of(b).all;
  Subject subject_a = a.subject(), subject_b = b.subject();
  if (subject_a.executor == subject_b.executor) {
    subject_a.executor += " in " + options.run;
    subject_b.executor += " in " + options.other;
  }
  subject_a.fewer = a.fewer_than(b);
  subject_b.fewer = b.fewer_than(a);
  show(report(subject_a, of_a, subject_b, of_b), options.json);
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
  Explainer explainer(
      system, chain, std::move(outputs), [&](const Explanation& explanation) { totals.add(explanation); },
      latency);
  explainer.begin(0, &plan.times);
  for (const JobRecord& record : run.trace.jobs) explainer.add(record);
  explainer.end();
  return totals;
}

}  // namespace

StoredOutputs::StoredOutputs(const results::StoredRun& run, const std::string& executor,
                             std::optional<std::uint32_t> repetition)
    : run_(run),
      stored_(run.check([&] { return setup::stored_system(run); })),
      executor_(executor_of(run, executor)),
      repetition_(repetition),
      subject_{stored_.tasks.set, executor_, ""} {
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
  if (!options.task.empty()) {
    subject_.latency = Latency::response;
    subject_.name = options.task;
    const TaskId task = place_of(options.task, stored_.tasks.set.tasks, "task");
    for_each_response([&](const Output& output) {
      if (output.sink != task) return;
      ++counted_[output.repetition];
      outputs_.push_back(output);
    });
  } else {
    const std::vector<Chain>& chains = stored_.graph.chains;
    if (chains.empty()) run.fail("its graph has no chain; name a task with --task");
    if (options.hot_path) subject_.latency = Latency::hot_path;
    subject_.name = options.chain.empty() ? chains.front().name : options.chain;
    chain_ = place_of(subject_.name, chains, "chain");
    run.for_each_chain([&](const ChainRow& row) {
      if (run.chains()[row.record.chain] != subject_.name || !selected(row.executor, row.repetition)) return;
      ++counted_[row.repetition];
      const auto latency = row.record.latency(subject_.latency);
      if (latency >= Duration{})
        outputs_.push_back({row.repetition, row.record.sequence, *latency, row.record.sink});
      else
        ++left_out_;
    });
  }
  for (const auto* sentences : {&run.record().warnings, &run.record().failures}) {
    std::ranges::copy_if(*sentences, std::back_inserter(subject_.warnings), [&](const std::string& sentence) {
      return sentence.starts_with(executor_ + " ") || sentence.starts_with(executor_ + ": ");
    });
  }
  if (outputs_.empty()) {
    const std::string why = program::joined(subject_.warnings, " ");
    run.fail(concat("it has no ", chain_ ? "output of " : "counted job of ", subject_.name, " under ",
                    executor_, "; take another executor or repetition, or a longer run",
                    why.empty() ? "" : ": " + why));
  }
}

bool StoredOutputs::selected(std::string_view executor, std::uint32_t repetition) const {
  return executor == executor_ && (!repetition_ || repetition == *repetition_);
}

void StoredOutputs::for_each_response(const std::function<void(const Output&)>& use) const {
  results::for_each_record(run_, [&](const JobRow& row) {
    const JobRecord& r = row.record;
    if (!selected(row.executor, row.repetition) || !results::counts(r, Time{} + run_.warm_up())) return;
    use({row.repetition, r.job.sequence, r.response_time(), r.job.task});
  });
}

std::size_t StoredOutputs::fewer_than(const StoredOutputs& other) const {
  if (run_.warm_up() != other.run_.warm_up() || run_.length() != other.run_.length()) return 0;
  std::size_t fewer = 0;
  for (const results::RepetitionRecord& r : run_.record().runs) {
    const auto theirs = other.counted_.find(r.repetition), own = counted_.find(r.repetition);
    if (!selected(r.executor, r.repetition) || theirs == other.counted_.end()) continue;
    const std::size_t count = own == counted_.end() ? 0 : own->second;
    fewer += theirs->second - std::min(theirs->second, count);
  }
  return fewer;
}

void StoredOutputs::explain(const std::vector<Output>& outputs, const Explainer::Use& use) {
  Explainer explainer(*system_, chain_, outputs, use, subject_.latency);
  pass_jobs(explainer);
  subject_.missing = explainer.missing() + left_out_;
  if (explainer.missing() == outputs.size()) run_.fail("its jobs.csv lacks the jobs of its outputs");
}

void StoredOutputs::explain_tasks(const results::StoredRun& run, const std::string& executor,
                                  std::size_t most, const Explainer::Use& use) {
  const StoredOutputs all(run, executor, std::nullopt);
  std::vector<std::vector<Output>> slowest(all.stored_.tasks.set.size());
  const auto keep = [most](std::vector<Output>& outputs) {
    std::ranges::stable_sort(outputs, std::greater<>(), &Output::latency);
    outputs.resize(std::min(outputs.size(), most));
  };
  all.for_each_response([&](const Output& output) {
    std::vector<Output>& of_task = slowest[output.sink];
    of_task.push_back(output);
    if (of_task.size() >= 4 * most) keep(of_task);
  });
  std::vector<Output> outputs;
  for (std::vector<Output>& of_task : slowest) {
    keep(of_task);
    outputs.insert(outputs.end(), of_task.begin(), of_task.end());
  }
  Explainer explainer(*all.system_, std::nullopt, std::move(outputs), use);
  all.pass_jobs(explainer);
}

void StoredOutputs::pass_jobs(Explainer& explainer) const {
  std::unique_ptr<ExecutionTimes> times;  // of a simulation; nullptr: not known
  const bool known = stored_.times && stored_.times->model;
  std::optional<std::uint32_t> current;
  results::for_each_record(run_, [&](const JobRow& row) {
    if (!selected(row.executor, row.repetition)) return;
    if (current != row.repetition) {
      if (current) explainer.end();
      const std::uint64_t seed = stored_.options.seed + row.repetition;
      if (known) times = simulated::execution_times_of(stored_.graph, stored_.tasks, seed);
      explainer.begin(row.repetition, times.get());
      current = row.repetition;
    }
    if (row.record.started() && row.record.start < explainer.last_start()) {
      throw InputError((run_.folder() / "jobs.csv").string(), static_cast<std::int64_t>(row.line),
                       "the job is not in the order of starts", "keep the order of the rows");
    }
    explainer.add(row.record);
  });
  if (current) explainer.end();
}

void Totals::add(const Explanation& explanation) {
  ++outputs;
  latency += explanation.latency;
  for (const Part& part : explanation.parts) {
    causes[static_cast<std::size_t>(part.cause)] += part.length;
    if (part.behind.task != kNoTask) behind[{part.cause, part.rule, part.behind.task}] += part.length;
    if (part.cause == Cause::running) running[explanation.path[part.step].job.task] += part.length;
  }
}

Overview::Overview(const std::vector<Output>& outputs) {
  constexpr double kBelowMedian = 0.45, kAboveMedian = 0.55;
  const std::vector<Output> sorted = sorted_by_latency(outputs);
  middle_from_ = at_quantile(sorted, kBelowMedian).latency;
  middle_to_ = at_quantile(sorted, kAboveMedian).latency;
  const auto worst = std::max(1.0, std::floor(kTail * static_cast<double>(sorted.size())));
  tail_from_ = sorted[sorted.size() - static_cast<std::size_t>(worst)].latency;
}

void Overview::add(const Explanation& explanation) {
  all.add(explanation);
  if (explanation.latency >= middle_from_ && explanation.latency <= middle_to_) middle.add(explanation);
  if (explanation.latency >= tail_from_) tail.add(explanation);
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
  const std::string first = options.executors.empty() ? "" : options.executors.front();
  StoredOutputs stored(run, first, options);
  if (!compares && one)
    return stored.explain({chosen(options, stored.outputs())},
                          [&](const Explanation& e) { show(report(stored.subject(), e), options.json); });
  if (!compares) {
    const Overview overview = overview_of(stored);  // counts what is missing, too
    return show(report(stored.subject(), overview), options.json);
  }
  const std::string second = options.executors.empty() ? "" : options.executors.back();
  if (options.other.empty() && first == second)
    throw UsageError("--executors: the two executors are the same");
  const results::StoredRun other(options.other.empty() ? options.run : options.other, "explain");
  StoredOutputs others(other, second, options);
  explain_difference(options, stored, others);
}

std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b, std::uint32_t chain,
                                    Latency latency) {
  const Totals of_a = totals_of(a, chain, latency), of_b = totals_of(b, chain, latency);
  if (of_a.outputs == 0 || of_b.outputs == 0) return {};
  const auto subject = [&](const simulated::Plan& plan) {
    return Subject{plan.tasks.set, plan.executor.label, plan.graph.chains[chain].name, latency};
  };
  Subject of = subject(a.plan), other = subject(b.plan);
  of.fewer = of_b.outputs - std::min(of_a.outputs, of_b.outputs);
  other.fewer = of_a.outputs - std::min(of_a.outputs, of_b.outputs);
  return report(of, of_a, other, of_b).sentences;
}

}  // namespace hotpath::explain
