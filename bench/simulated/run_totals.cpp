// SPDX-License-Identifier: Apache-2.0
#include "simulated/run_totals.hpp"

#include <cmath>

namespace hotpath::simulated {

namespace {

/// Adds `n` more values with these extremes and this sum.
void merge(Quantiles& q, std::uint64_t n, double least, double most, double sum) {
  if (q.n > 0) sum += q.mean * static_cast<double>(q.n);
  q.n += n;
  q.min = std::fmin(q.min, least);
  q.max = std::fmax(q.max, most);
  q.mean = sum / static_cast<double>(q.n);
}

}  // namespace

void RunTotals::ended(const JobRecord& record) {
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

void RunTotals::add_to(results::ExecutorSummary& summary, std::size_t repetition) {
  for (TaskId id = 0; id < set_.size(); ++id) {
    OfTask& t = of_task_[id];
    t.periods.end(set_[id]);
    summary.each[repetition].deadline_overruns += t.counts.deadline_overruns;
    results::TaskSummary& task = summary.tasks[id];
    task.after_warm_up += t.counts;
    summary.after_warm_up += t.counts;
    task.longest_wait = std::max(task.longest_wait, t.longest_wait);
    t.periods.add_to(task);
    if (t.responses > 0) merge(task.response_ms, t.responses, to_ms(t.least), to_ms(t.most), t.sum_ms);
  }
}

void RunTotals::Periods::take(const Started& job, const Task& timer) {
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

void RunTotals::Periods::add_to(results::TaskSummary& task) const {
  if (n == 0) return;
  if (!task.period_ms) task.period_ms.emplace(), task.period_deviation_ms.emplace();
  merge(*task.period_ms, n, to_ms(least), to_ms(most), sum_ms);
  merge(*task.period_deviation_ms, n, kNoValue, to_ms(furthest), sum_deviations_ms);
}

}  // namespace hotpath::simulated
