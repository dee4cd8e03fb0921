// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include "explain/stored_outputs.hpp"
#include "program/errors.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::explain {

namespace {

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

const Output& chosen(const Options& options, const StoredOutputs& stored,
                     const std::vector<Output>& by_latency) {
  if (!options.sequence) return at_quantile(by_latency, options.quantile.value_or(1));
  const auto output = std::ranges::find(stored.outputs(), *options.sequence, &Output::sequence);
  if (output != stored.outputs().end()) return *output;
  throw program::UsageError(program::concat("--sequence: no counted output has sequence ", *options.sequence,
                                            "; the first has ", stored.outputs().front().sequence,
                                            ", the last ", stored.outputs().back().sequence));
}

void explain_one(const Options& options, StoredOutputs& stored) {
  const std::vector<Output> by_latency = sorted_by_latency(stored.outputs());
  stored.explain({chosen(options, stored, by_latency)},
                 [&](const Explanation& e) { show(report(stored.subject(), e), options.json); });
}

void explain_all(const Options& options, StoredOutputs& stored) {
  Overview overview(stored.outputs());
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { overview.add(explanation); });
  show(report(stored.subject(), overview), options.json);
}

Totals totals_of(StoredOutputs& stored) {
  Totals totals;
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { totals.add(explanation); });
  return totals;
}

void explain_difference(const Options& options, StoredOutputs& a, StoredOutputs& b) {
  if (!std::ranges::equal(a.subject().set.tasks, b.subject().set.tasks, {}, &Task::name, &Task::name))
    throw program::UsageError("explain: the runs have different tasks; compare runs of one graph");
  const Totals of_a = totals_of(a), of_b = totals_of(b);
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
  const System system(run.executor, run.graph, run.tasks, results::RunKind::simulated,
                      run.graph.platform.cores);
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
  explainer.begin(0, &run.times);
  for (const JobRecord& record : run.trace.jobs) explainer.add(record);
  explainer.end();
  return totals;
}

}  // namespace

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
  if (options.executors.size() > 2)
    throw program::UsageError("--executor: give one executor, or two to compare");
  if (compares && one) {
    throw program::UsageError(
        "explain: a comparison covers all outputs; leave out --worst, --quantile and --sequence");
  }
  const results::StoredRun run(options.run, "explain");
  const std::string first = options.executors.empty() ? "" : options.executors.front();
  StoredOutputs stored(run, first, options);
  if (!compares) return one ? explain_one(options, stored) : explain_all(options, stored);
  const std::string second = options.executors.empty() ? "" : options.executors.back();
  if (options.other.empty() && first == second)
    throw program::UsageError("--executor: the two executors are the same");
  const results::StoredRun other(options.other.empty() ? options.run : options.other, "explain");
  StoredOutputs others(other, second, options);
  explain_difference(options, stored, others);
}

std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b, std::uint32_t chain,
                                    Latency latency) {
  const Totals of_a = totals_of(a, chain, latency), of_b = totals_of(b, chain, latency);
  if (of_a.outputs == 0 || of_b.outputs == 0) return {};
  const std::string& name = a.graph.chains[chain].name;
  Subject of{a.tasks.set, a.name, name, latency}, other{b.tasks.set, b.name, name, latency};
  of.fewer = of_b.outputs - std::min(of_a.outputs, of_b.outputs);
  other.fewer = of_a.outputs - std::min(of_a.outputs, of_b.outputs);
  return report(of, of_a, other, of_b).sentences;
}

}  // namespace hotpath::explain
