// SPDX-License-Identifier: Apache-2.0
#include "simulated/run_totals.hpp"

#include <algorithm>
#include <cmath>

namespace hotpath {

RunTotals::RunTotals(const TaskSet& set, const std::vector<MeasuredChain>& chains, Time counted_from)
    : set_(set), counted_from_(counted_from), is_sink_(set.size(), false), of_task_(set.size()) {
  for (const MeasuredChain& chain : chains) {
    for (const TaskId id : chain.sink_tasks) is_sink_[id] = true;
  }
}

void RunTotals::started(const JobRecord& record) {
  if (is_sink_[record.job.task] && record.job.timestamp < counted_from_) {
    early_.emplace(record.job.task, record.job.sequence);
  }
}

void RunTotals::ended(const JobRecord& record) {
  OfTask& t = of_task_[record.job.task];
  ++t.account.count[static_cast<std::size_t>(record.outcome)];
  t.account.count[static_cast<std::size_t>(Outcome::skipped)] += record.job.skipped;
  const Task& task = set_[record.job.task];
  if (task.kind == TaskKind::timer) t.counts.add(task, record, counted_from_);
  if (!counts(record, counted_from_)) return;
  const Duration response = response_time(record);
  ++t.responses;
  t.least = std::min(t.least, response);
  t.most = std::max(t.most, response);
  t.sum_ms += to_ms(response);
}

void RunTotals::count(std::vector<TaskAccount>& accounts) const {
  for (TaskId id = 0; id < set_.size(); ++id) accounts[id].count = of_task_[id].account.count;
}

void RunTotals::add_to(ExecutorSummary& summary) const {
  for (TaskId id = 0; id < set_.size(); ++id) {
    const OfTask& t = of_task_[id];
    TaskSummary& task = summary.tasks[id];
    task.after_warm_up += t.counts;
    summary.after_warm_up += t.counts;
    if (t.responses == 0) continue;
    Quantiles& q = task.response_ms;
    const double all = (q.n == 0 ? 0 : q.mean * static_cast<double>(q.n)) + t.sum_ms;
    q.n += t.responses;
    q.min = std::fmin(q.min, to_ms(t.least));
    q.max = std::fmax(q.max, to_ms(t.most));
    q.mean = all / static_cast<double>(q.n);
  }
}

}  // namespace hotpath
