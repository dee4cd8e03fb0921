// SPDX-License-Identifier: Apache-2.0
#include "simulated/run_totals.hpp"

#include <cmath>

namespace hotpath::simulated {

void RunTotals::Extremes::add(Duration value) {
  ++n;
  least = std::min(least, value);
  most = std::max(most, value);
  sum_ms += to_ms(value);
}

void RunTotals::Extremes::add_to(Quantiles& q) const {
  if (n == 0) return;
  const double sum = q.n > 0 ? sum_ms + q.mean * static_cast<double>(q.n) : sum_ms;
  q.n += n;
  q.min = std::fmin(q.min, to_ms(least));
  q.max = std::fmax(q.max, to_ms(most));
  q.mean = sum / static_cast<double>(q.n);
}

void RunTotals::OfTask::add_period(const Task& timer, Duration period) {
  periods.add(period);
  deviations.add(results::period_deviation(timer, period));
}

void RunTotals::ended(const JobRecord& record) {
  chains_.add_end(record);
  OfTask& t = of_task_[record.job.task];
  t.account.add(record);
  const Task& task = set_[record.job.task];
  t.add(task, record, counted_from_, end_);
  if (task.kind == TaskKind::timer && record.outcome == Outcome::ran) {
    t.starts.add(record, record.job.timestamp >= counted_from_, [&](Duration d) { t.add_period(task, d); });
  }
  if (results::counts(record, counted_from_)) t.responses.add(record.response_time());
}

void RunTotals::add_to(results::ExecutorSummary& summary, std::size_t repetition) {
  for (TaskId id = 0; id < set_.size(); ++id) {
    OfTask& t = of_task_[id];
    t.starts.end([&](Duration period) { t.add_period(set_[id], period); });
    summary.each[repetition].deadline_overruns += t.after_warm_up.deadline_overruns;
    summary.after_warm_up += t.after_warm_up;
    results::TaskSummary& task = summary.tasks[id];
    task.after_warm_up += t.after_warm_up;
    task.longest_wait = std::max(task.longest_wait, t.longest_wait);
    t.responses.add_to(task.response_ms);
    if (t.periods.n == 0) continue;
    if (!task.period_ms) task.period_ms.emplace(), task.period_deviation_ms.emplace();
    t.periods.add_to(*task.period_ms);
    t.deviations.add_to(*task.period_deviation_ms);
    task.period_deviation_ms->min = kNoValue;
  }
}

}  // namespace hotpath::simulated
