// SPDX-License-Identifier: Apache-2.0
#include "explain/job_window.hpp"

#include <algorithm>

#include "program/memory_limit.hpp"

namespace hotpath::explain {

const Seen& JobWindow::add(const JobRecord& record) {
  if (++jobs_ > checked_) {
    checked_ *= 2;
    program::check_trace_memory(static_cast<double>(2 * checked_ * sizeof(Seen)), run_,
                                "a run with shorter latencies, since all jobs within one latency are kept");
  }
  Seen seen{record, next_order_++};
  if (record.outcome == Outcome::running) seen.record.finish = kNever;
  if (record.worker >= by_worker_.size()) by_worker_.resize(record.worker + 1U);
  by_worker_[record.worker].push_back(seen);
  return by_task_[record.job.task].emplace_back(seen);
}

void JobWindow::forget_before(Time horizon) {
  const auto forget = [horizon](std::deque<Seen>& jobs) {
    while (!jobs.empty() && jobs.front().record.finish < horizon) jobs.pop_front();
  };
  std::ranges::for_each(by_worker_, forget);
  jobs_ = 0;
  for (std::deque<Seen>& jobs : by_task_) {
    forget(jobs);
    jobs_ += jobs.size();
  }
}

void JobWindow::clear() {
  for (std::deque<Seen>& jobs : by_task_) jobs.clear();
  by_worker_.clear();
  jobs_ = 0;
  next_order_ = 0;
}

const Seen* JobWindow::find(JobRef job) const {
  if (job.task >= by_task_.size()) return nullptr;
  const std::deque<Seen>& jobs = by_task_[job.task];
  const auto match =
      std::find_if(jobs.rbegin(), jobs.rend(), [&](const Seen& s) { return s.record.job.ref() == job; });
  return match == jobs.rend() ? nullptr : &*match;
}

std::vector<const Seen*> JobWindow::overlapping(std::size_t worker, Time from, Time to) const {
  std::vector<const Seen*> jobs;
  if (worker >= by_worker_.size()) return jobs;
  const std::deque<Seen>& all = by_worker_[worker];
  for (auto seen = all.rbegin(); seen != all.rend() && seen->record.finish > from; ++seen) {
    if (seen->record.start < to) jobs.push_back(&*seen);
  }
  std::ranges::reverse(jobs);
  return jobs;
}

}  // namespace hotpath::explain
