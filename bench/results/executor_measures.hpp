// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "results/schedule.hpp"
#include "results/summary.hpp"

namespace hotpath::results {

/// The measures of the jobs of one repetition.
class JobMeasures {
 public:
  /// Without the samples (`keeps_samples`) there are no quantiles.
  JobMeasures(const TaskSet& set, Time counted_from, Time end, bool keeps_samples = true);

  void add(const JobRecord& job);
  /// Ends the repetition: the measures by task.
  [[nodiscard]] std::vector<TaskMeasures> result();

 private:
  const TaskSet& set_;
  const Time counted_from_, end_;
  std::vector<TaskMeasures> tasks_;
  std::vector<StartDistances> starts_;                       // by task
  std::optional<NextCalls> next_calls_;                      // for sets without subscriptions
  std::vector<std::vector<std::pair<Time, Time>>> counted_;  // with them: starts and finishes by task
};

/// Collects the summary of one executor job by job, in 8 bytes per counted job, 16 more per counted job of a
/// timer, and for sets without subscriptions 32 per counted job of the current repetition.
class ExecutorMeasures {
 public:
  /// The arguments must outlive it.
  ExecutorMeasures(std::string executor, const TaskSet& set, const SummaryOptions& options);

  /// Begins a repetition, whose jobs follow.
  void begin(Time epoch, Time end);
  void add(const JobRecord& job) { current_->add(job); }
  /// Ends the repetition of this number, which no other one has. `measures`: of jobs that were not added.
  void end(std::uint32_t repetition, const ProcessUsage& usage, std::uint64_t lost_records,
           const std::vector<TaskAccount>& accounts, std::vector<TaskMeasures> measures = {});
  /// Adds an output of a chain in a repetition that has ended.
  void add(std::uint32_t repetition, const ChainRecord& output);

  /// The summary of all executors, with the comparisons with the baseline.
  [[nodiscard]] static Summary summary(std::vector<ExecutorMeasures> all, const SummaryOptions& options);

 private:
  /// Latencies of one repetition, in milliseconds.
  struct Latencies {
    std::vector<double> hot_path, end_to_end;
    std::vector<Time> finishes;
  };
  struct ChainSamples {
    RepeatedSamples hot_path, end_to_end;
  };

  /// Completes the summary, without comparisons.
  void finish();
  void finish_task(TaskId id);
  void finish_chain(std::size_t chain);

  const TaskSet& set_;
  const SummaryOptions& options_;
  ExecutorSummary summary_;
  std::optional<JobMeasures> current_;
  Duration length_{};                                          // of all repetitions
  std::vector<std::map<std::uint32_t, Latencies>> latencies_;  // by chain, then by repetition
  std::vector<ChainSamples> samples_;                          // by chain, after finish()
};

}  // namespace hotpath::results
