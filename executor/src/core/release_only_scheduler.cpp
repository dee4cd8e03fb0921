// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/release_only_scheduler.hpp"

namespace hotpath {

Effect ReleaseOnlyScheduler::release_timers(Worker worker, Time now) {
  Effect effect;
  if (worker != timer_management()) return effect;
  while (timers_.due(now)) {
    events_->push(timers_.call_head(now));
    ++effect.released;
    if (release_ == Release::one_by_one) break;
  }
  if (effect.released > 0) effect.wake = executors();
  return effect;
}

Decision ReleaseOnlyScheduler::decide(Worker worker, Time now) {
  if (worker != timer_management()) return next_event(now);
  return {std::nullopt, timers_.next_due(), {}};
}

}  // namespace hotpath
