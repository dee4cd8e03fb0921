// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "explain/stored_outputs.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::explain {

namespace {

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

ComparedOutputs compared(StoredOutputs& stored) {
  ComparedOutputs outputs;
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { outputs.add(explanation); });
  return outputs;
}

/// By repetition of the executor: the timers' first timestamps.
auto first_timestamps(const StoredOutputs& stored) {
  std::map<std::uint32_t, std::map<std::string, Duration>> timestamps;
  for (const results::RepetitionRecord& r : stored.run().record().runs) {
    if (r.executor == stored.subject().executor) timestamps[r.repetition] = r.first_timestamps;
  }
  return timestamps;
}

/// Whether the same job has the same execution time and timestamp in both.
bool same_jobs(const StoredOutputs& a, const StoredOutputs& b) {
  const results::RunRecord &of_a = a.run().record(), &of_b = b.run().record();
  const auto work = [](const Task& task) { return std::tuple(task.wcet, task.period); };
  const auto times = [](const results::RunRecord& r) {
    return r.simulation ? r.simulation->execution_times : "";
  };
  if (of_a.kind != of_b.kind || of_a.work != of_b.work || times(of_a) != times(of_b)) return false;
  if (of_a.kind == results::RunKind::simulated && of_a.seed != of_b.seed) return false;
  if (!std::ranges::equal(of_a.tasks.tasks, of_b.tasks.tasks, {}, work, work)) return false;
  const auto first = first_timestamps(a), others = first_timestamps(b);
  return std::ranges::all_of(first, [&](const auto& of_repetition) {
    const auto other = others.find(of_repetition.first);
    return other == others.end() || other->second == of_repetition.second;
  });
}

void explain_difference(const Options& options, StoredOutputs& a, StoredOutputs& b) {
  if (!std::ranges::equal(a.subject().set.tasks, b.subject().set.tasks, {}, &Task::name, &Task::name))
    throw program::UsageError("explain: the runs have different tasks; compare runs of one graph");
  const ComparedOutputs of_a = compared(a), of_b = compared(b);
  Subject subject_a = a.subject(), subject_b = b.subject();
  if (subject_a.executor == subject_b.executor) {
    subject_a.executor += " in " + options.run;
    subject_b.executor += " in " + options.other;
  }
  const bool pairs = !subject_a.chain.empty() && same_jobs(a, b);
  show(report(subject_a, subject_b, compare(of_a, of_b, pairs)), options.json);
}

ComparedOutputs compared(const SimulatedRun& run, std::uint32_t chain) {
  const System system(run.executor, run.graph, run.tasks, results::RunKind::simulated,
                      run.graph.platform.cores);
  std::vector<Output> outputs;
  for (const ChainRecord& record : run.trace.chains) {
    if (record.chain == chain && record.hot_path_latency >= Duration{})
      outputs.push_back({0, record.sequence, record.hot_path_latency, record.sink});
  }
  ComparedOutputs explained;
  Explainer explainer(system, {chain, kNoTask}, std::move(outputs), run.name,
                      [&](const Explanation& explanation) { explained.add(explanation); });
  explainer.begin(0, &run.times);
  for (const JobRecord& record : run.trace.jobs) explainer.add(record);
  explainer.end();
  return explained;
}

}  // namespace

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

std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b, std::uint32_t chain) {
  const ComparedOutputs of_a = compared(a, chain), of_b = compared(b, chain);
  if (of_a.by_source.empty() || of_b.by_source.empty()) return {};
  const std::string& name = a.graph.chains[chain].name;
  const Comparison comparison = compare(of_a, of_b, true);
  return report({a.tasks.set, a.name, name, "", 0}, {b.tasks.set, b.name, name, "", 0}, comparison).sentences;
}

}  // namespace hotpath::explain
