// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
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
  /// Distances of a timer's starts. Jobs that end out of order wait for the earlier ones.
  struct Periods {
    void add(const JobRecord& r, const Task& timer, bool counted) {
      const Started job{r.start, r.job.sequence + 1 + r.job.skipped, counted};
      if (waiting_.empty() && r.job.sequence <= next_) return take(job, timer);
      waiting_.emplace(r.job.sequence, job);
      while (!waiting_.empty() && waiting_.begin()->first <= next_) take_first(timer);
    }
    /// A job that still waits or runs at the end is left out.
    void end(const Task& timer) {
      while (!waiting_.empty()) take_first(timer);
    }
    void add_to(results::TaskSummary& task) const;

   private:
    struct Started {
      Time start;
      std::uint64_t next = 0;  // sequence of the next job
      bool counted = false;
    };
    void take(const Started& job, const Task& timer);
    void take_first(const Task& timer) { take(waiting_.extract(waiting_.begin()).mapped(), timer); }
    Extremes distances_, deviations_;
    std::map<std::uint64_t, Started> waiting_;  // by sequence
    std::optional<Time> before_;
    std::uint64_t next_ = 0;
  };
  struct OfTask : results::TaskTotals {
    TaskAccount account;
    Periods periods;
    Extremes responses;
  };
  const TaskSet& set_;
  const Time counted_from_, end_;
  ChainJoin chains_;
  std::vector<OfTask> of_task_;
};

}  // namespace hotpath::simulated
