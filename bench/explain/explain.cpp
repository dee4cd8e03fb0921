// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "explain/stored_outputs.hpp"
#include "program/errors.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::explain {

namespace {

void show(const Options& options, auto&&... what) {
  if (!options.json) return write(std::cout, what...);
  program::data_output() << json_of(what...).dump(2) << "\n";
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
                 [&](const Explanation& explanation) { show(options, stored.subject(), explanation); });
}

void explain_all(const Options& options, StoredOutputs& stored) {
  Overview overview(stored.outputs());
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { overview.add(explanation); });
  show(options, stored.subject(), overview);
}

ComparedOutputs compared(StoredOutputs& stored) {
  ComparedOutputs outputs;
  stored.explain(stored.outputs(), [&](const Explanation& explanation) { outputs.add(explanation); });
  return outputs;
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
  const auto first = [](const StoredOutputs& stored) {
    std::map<std::uint32_t, std::map<std::string, Duration>> timestamps;  // by repetition
    for (const results::RepetitionRecord& r : stored.run().record().runs) {
      if (r.executor == stored.subject().executor) timestamps[r.repetition] = r.first_timestamps;
    }
    return timestamps;
  };
  const auto first_b = first(b);
  for (const auto& [repetition, timestamps] : first(a)) {
    const auto other = first_b.find(repetition);
    if (other != first_b.end() && other->second != timestamps) return false;
  }
  return true;
}

void explain_difference(const Options& options, StoredOutputs& a, StoredOutputs& b) {
  const auto name = [](const Task& task) { return task.name; };
  if (!std::ranges::equal(a.subject().set.tasks, b.subject().set.tasks, {}, name, name)) {
    throw program::UsageError("explain: the runs have different tasks; compare runs of one graph");
  }
  ComparedOutputs of_a = compared(a), of_b = compared(b);
  Subject subject_a = a.subject(), subject_b = b.subject();
  if (subject_a.executor == subject_b.executor) {
    subject_a.executor += " in " + options.run;
    subject_b.executor += " in " + options.other;
  }
  const bool pairs = !subject_a.chain.empty() && same_jobs(a, b);
  show(options, subject_a, subject_b, compare(std::move(of_a), std::move(of_b), pairs));
}

}  // namespace

void explain(const Options& options) {
  if (options.executors.size() > 2)
    throw program::UsageError("--executor: give one executor, or two to compare");
  const bool compares = options.executors.size() == 2 || !options.other.empty();
  if (compares && (options.worst || options.quantile || options.sequence)) {
    throw program::UsageError(
        "explain: a comparison covers all outputs; leave out --worst, --quantile and --sequence");
  }
  const results::StoredRun run(options.run, "explain");
  const std::string first = options.executors.empty() ? "" : options.executors.front();
  StoredOutputs stored(run, first, options);
  if (compares) {
    const std::string second = options.executors.empty() ? "" : options.executors.back();
    if (options.other.empty() && first == second)
      throw program::UsageError("--executor: the two executors are the same");
    const results::StoredRun other(options.other.empty() ? options.run : options.other, "explain");
    StoredOutputs others(other, second, options);
    return explain_difference(options, stored, others);
  }
  if (options.worst || options.quantile || options.sequence) return explain_one(options, stored);
  explain_all(options, stored);
}

}  // namespace hotpath::explain
