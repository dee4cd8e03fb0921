// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "results/summary.hpp"

namespace hotpath::simulated {

/// The data of a summary for a simulation that keeps no jobs. It stores only the ends of the jobs at
/// both ends of chains.
class RunTotals final : public JobSink {
 public:
  /// Jobs after the instant `counted_from` count; the run ends at `end`.
  RunTotals(const Graph& graph, const GraphTasks& tasks, Time counted_from, Time end)
      : set_(tasks.set),
        counted_from_(counted_from),
        end_(end),
        chains_(graph, tasks),
        of_task_(set_.size()) {}

  void started(const JobRecord& record) override { chains_.add_start(record); }

  void ended(const JobRecord& record) override;

  /// Fills in the counts of `accounts`.
  void count(std::vector<TaskAccount>& accounts) const {
    for (TaskId id = 0; id < set_.size(); ++id) accounts[id].count = of_task_[id].account.count;
  }
  /// The ends of the chains.
  const ChainJoin& chains() const { return chains_; }
  /// Whether the sink's job belongs to the warm-up.
  bool early(JobRef sink) const {
    const std::optional<Time> timestamp = chains_.sink_timestamp(sink);
    return timestamp && *timestamp < counted_from_;
  }
  /// Ends the run: adds response times, waits and deadline overruns to the summary of its executor.
  void add_to(results::ExecutorSummary& summary, std::size_t repetition);

 private:
  /// The extremes and the sum of samples.
  struct Extremes {
    std::uint64_t n = 0;
    Duration least = Duration::max(), most = Duration::min();
    double sum_ms = 0;

    void add(Duration value);
    void add_to(Quantiles& q) const;
  };
  struct OfTask : results::TaskTotals {
    TaskAccount account;
    results::StartDistances starts;
    Extremes responses, periods, deviations;

    void add_period(const Task& timer, Duration period);
  };
  const TaskSet& set_;
  const Time counted_from_, end_;
  ChainJoin chains_;
  std::vector<OfTask> of_task_;
};

}  // namespace hotpath::simulated
