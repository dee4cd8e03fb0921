// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <optional>
#include <span>
#include <utility>

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

std::vector<SpeedJudgement> judge_speed(const std::vector<ExecutorRuns>& runs) {
  std::vector<std::span<const SpeedWindow>> all;
  for (const ExecutorRuns& of_executor : runs) {
    for (const Repetition& r : of_executor.repetitions) all.emplace_back(r.speed);
  }
  const std::optional<double> usual = usual_pace(all);
  std::vector<SpeedJudgement> judgements;
  for (const ExecutorRuns& of_executor : runs) {
    SpeedJudgement& judgement = judgements.emplace_back();
    for (const Repetition& r : of_executor.repetitions) {
      if (!usual || !usual_pace({r.speed})) continue;
      ++judgement.observed;
      std::vector<SlowPeriod> slow = slow_periods(r.speed, *usual);
      if (!slow.empty()) judgement.slow.push_back({r.trace.repetition, std::move(slow)});
    }
  }
  return judgements;
}

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  std::vector<std::vector<RepeatedSamples>> hot_paths;  // by executor and chain
  for (const ExecutorRuns& of_executor : runs) {
    summary.executors.push_back(measures_of(set, of_executor, options).finish(hot_paths.emplace_back()));
  }
  compare_with_baseline(summary, hot_paths);
  std::vector<SpeedJudgement> speeds = judge_speed(runs);
  for (std::size_t e = 0; e < runs.size(); ++e) summary.executors[e].speed = std::move(speeds[e]);
  return summary;
}

}  // namespace hotpath::results
