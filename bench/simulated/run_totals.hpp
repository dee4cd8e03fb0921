// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "hotpath/core/job_sink.hpp"
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

  void ended(const JobRecord& record) override {
    chains_.add_end(record);
    OfTask& t = of_task_[record.job.task];
    ++t.account.count[static_cast<std::size_t>(record.outcome)];
    t.account.count[static_cast<std::size_t>(Outcome::skipped)] += record.job.skipped;
    t.longest_wait = std::max(t.longest_wait, results::wait_of(record, counted_from_, end_));
    const Task& task = set_[record.job.task];
    if (task.kind == TaskKind::timer) t.counts.add(task, record, counted_from_, end_);
    if (task.kind == TaskKind::timer && record.outcome == Outcome::ran) {
      t.periods.add(record, task, record.job.timestamp >= counted_from_);
    }
    if (!results::counts(record, counted_from_)) return;
    const Duration response = results::response_time(record);
    ++t.responses;
    t.least = std::min(t.least, response);
    t.most = std::max(t.most, response);
    t.sum_ms += to_ms(response);
  }

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
  void add_to(results::ExecutorSummary& summary, std::size_t repetition) {
    for (TaskId id = 0; id < set_.size(); ++id) {
      OfTask& t = of_task_[id];
      t.periods.end(set_[id]);
      summary.each[repetition].deadline_overruns += t.counts.deadline_overruns;
      results::TaskSummary& task = summary.tasks[id];
      task.after_warm_up += t.counts;
      summary.after_warm_up += t.counts;
      task.longest_wait = std::max(task.longest_wait, t.longest_wait);
      if (t.periods.n > 0) t.periods.add_to(task);
      if (t.responses == 0) continue;
      Quantiles& q = task.response_ms;
      const double sum = (q.n == 0 ? 0 : q.mean * static_cast<double>(q.n)) + t.sum_ms;
      q.n += t.responses;
      q.min = std::fmin(q.min, to_ms(t.least));
      q.max = std::fmax(q.max, to_ms(t.most));
      q.mean = sum / static_cast<double>(q.n);
    }
  }

 private:
  /// Distances of a timer's starts. Jobs that end out of order wait for the earlier ones.
  struct Periods {
    std::uint64_t n = 0;
    Duration least = Duration::max(), most = Duration::min(), furthest{};
    double sum_ms = 0, sum_deviations_ms = 0;

    void add(const JobRecord& r, const Task& timer, bool counted) {
      waiting_.emplace(r.job.sequence, Started{r.start, r.job.sequence + 1 + r.job.skipped, counted});
      while (!waiting_.empty() && waiting_.begin()->first <= next_) take_first(timer);
    }
    /// A job that still waits or runs at the end is left out.
    void end(const Task& timer) {
      while (!waiting_.empty()) take_first(timer);
    }
    void add_to(results::TaskSummary& task) const {
      add_to(task.period_ms, to_ms(least), to_ms(most), sum_ms);
      add_to(task.period_deviation_ms, kNoValue, to_ms(furthest), sum_deviations_ms);
    }

   private:
    struct Started {
      Time start;
      std::uint64_t next = 0;  // sequence of the next job
      bool counted = false;
    };
    void take_first(const Task& timer) {
      const Started job = waiting_.extract(waiting_.begin()).mapped();
      next_ = job.next;
      if (!job.counted) return;
      if (before_) {
        const Duration period = job.start - *before_, deviation = results::period_deviation(timer, period);
        ++n;
        least = std::min(least, period);
        most = std::max(most, period);
        furthest = std::max(furthest, deviation);
        sum_ms += to_ms(period);
        sum_deviations_ms += to_ms(deviation);
      }
      before_ = job.start;
    }
    void add_to(std::optional<Quantiles>& quantiles, double least_ms, double most_ms, double sum) const {
      if (!quantiles) quantiles.emplace();
      Quantiles& q = *quantiles;
      sum += q.n == 0 ? 0 : q.mean * static_cast<double>(q.n);
      q.n += n;
      q.min = std::fmin(q.min, least_ms);
      q.max = std::fmax(q.max, most_ms);
      q.mean = sum / static_cast<double>(q.n);
    }
    std::map<std::uint64_t, Started> waiting_;  // by sequence
    std::optional<Time> before_;
    std::uint64_t next_ = 0;
  };
  struct OfTask {
    TaskAccount account;
    results::TimerCounts counts;
    Periods periods;
    std::uint64_t responses = 0;
    Duration least = Duration::max(), most{}, longest_wait{};
    double sum_ms = 0;
  };
  const TaskSet& set_;
  const Time counted_from_, end_;
  ChainJoin chains_;
  std::vector<OfTask> of_task_;
};

}  // namespace hotpath::simulated
