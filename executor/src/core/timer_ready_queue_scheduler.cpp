// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/timer_ready_queue_scheduler.hpp"

namespace hotpath {

Effect TimerReadyQueueScheduler::release_timers(Worker worker, Time now) {
  Effect effect;
  if (worker != kTimerManagement) return effect;
  while (timers_.due(now)) {
    timer_ready_->push(timers_.call_head(now));
    ++effect.released;
  }
  return effect;
}

Decision TimerReadyQueueScheduler::decide(Worker worker, Time now) {
  if (worker == kExecutor) return next_event(now);
  const std::optional<Job> job = next_of(*timer_ready_);
  return {job, job ? kNever : timers_.next_due(), {}};
}

void TimerReadyQueueScheduler::unfinished(Time now, const Visitor& visit) const {
  timer_ready_->for_each([&](const Job& job) { visit(job, Outcome::queued); });
  EventsScheduler::unfinished(now, visit);
}

}  // namespace hotpath
