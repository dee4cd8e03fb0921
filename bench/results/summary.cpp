// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <vector>

#include "results/executor_measures.hpp"

namespace hotpath::results {

namespace {

ExecutorMeasures measures_of(const TaskSet& set, const ExecutorRuns& runs, const SummaryOptions& options) {
  ExecutorMeasures measures(runs.executor, set, options);
  std::uint32_t place = 0;
  for (const Repetition& repetition : runs.repetitions) {
    const Trace& trace = repetition.trace;
    measures.begin(trace.epoch, trace.end);
    for (const JobRecord& r : trace.jobs) measures.add(r);
    measures.end(place, trace.repetition, repetition.usage, trace.lost_records, repetition.accounts);
    for (const ChainRecord& r : trace.chains) measures.add(place, r);
    ++place;
  }
  return measures;
}

}  // namespace

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  std::vector<std::vector<ChainSamples>> samples;  // by executor and chain
  for (const ExecutorRuns& of_executor : runs) {
    summary.executors.push_back(measures_of(set, of_executor, options).finish(samples.emplace_back()));
  }
  compare_with_baseline(summary, samples);
  return summary;
}

}  // namespace hotpath::results
