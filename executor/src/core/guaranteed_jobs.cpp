// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/guaranteed_jobs.hpp"

#include <algorithm>

namespace hotpath {

void GuaranteedJobs::arrived(TaskId task, Time now) {
  if (wait_ > Duration::zero()) waiting_.push_back({task, now});
}

void GuaranteedJobs::started(TaskId task) {
  const auto oldest = std::ranges::find(waiting_, task, &Waiting::task);
  if (oldest != waiting_.end()) waiting_.erase(oldest);
}

void GuaranteedJobs::removed(TaskId task) {
  std::erase_if(waiting_, [task](const Waiting& waiting) { return waiting.task == task; });
}

Time GuaranteedJobs::next_change(Time now) const {
  if (waiting_.empty()) return kNever;
  const Time overdue = std::max(next_, waiting_.front().since + wait_);
  return overdue > now ? overdue : kNever;
}

void GuaranteedJobs::describe(StateWords& words) const {
  if (wait_ == Duration::zero()) return;
  words.add(next_);
  for (const Waiting& waiting : waiting_) {
    words.add(waiting.task);
    words.add(waiting.since);
  }
}

}  // namespace hotpath
