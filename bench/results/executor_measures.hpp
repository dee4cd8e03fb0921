// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "results/schedule.hpp"
#include "results/summary.hpp"

namespace hotpath::results {

/// Collects the summary of one executor job by job, in 8 bytes per counted job, 8 more per counted job of a
/// timer, and for sets without subscriptions 32 per counted job of the current repetition. A measure over
/// single jobs belongs into add(const JobRecord&).
class ExecutorMeasures {
 public:
  /// The arguments must outlive it.
  ExecutorMeasures(std::string executor, const TaskSet& set, const SummaryOptions& options);

  /// Begins a repetition, whose jobs follow.
  void begin(Time epoch, Time end);
  void add(const JobRecord& job);
  /// Ends the repetition of this number, which no other one has.
  void end(std::uint32_t repetition, const ProcessUsage& usage, std::uint64_t lost_records,
           const std::vector<TaskAccount>& accounts);
  /// Adds an output of a chain in a repetition that has ended.
  void add(std::uint32_t repetition, const ChainRecord& output);

  /// The summary of all executors, with the comparisons with the baseline.
  [[nodiscard]] static Summary summary(std::vector<ExecutorMeasures> all, const SummaryOptions& options);

 private:
  struct Current {
    Time counted_from, end;
    std::vector<StartDistances> starts;                       // by task
    std::optional<NextCalls> next_calls;                      // for sets without subscriptions
    std::vector<std::vector<std::pair<Time, Time>>> counted;  // with them: starts and finishes by task
  };
  /// Latencies of one repetition, in milliseconds.
  struct Latencies {
    std::vector<double> hot_path, end_to_end, disparity;
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
  const bool timers_only_;
  std::optional<Current> current_;
  Duration length_{};                                          // of all repetitions
  std::uint64_t overruns_before_ = 0;                          // deadline overruns of ended repetitions
  std::vector<std::deque<double>> responses_, authors_;        // ms, by task
  std::vector<std::deque<Duration>> periods_;                  // by task
  std::vector<std::map<std::uint32_t, Latencies>> latencies_;  // by chain, then by repetition
  std::vector<ChainSamples> samples_;                          // by chain, after finish()
};

}  // namespace hotpath::results
