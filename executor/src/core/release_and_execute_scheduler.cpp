// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/release_and_execute_scheduler.hpp"

namespace hotpath {

Decision ReleaseAndExecuteScheduler::decide(Worker worker, Time now) {
  if (worker == kExecutor) return next_event(now);
  if (!timers_.due(now)) return {std::nullopt, timers_.next_due(), {}};
  if (!follows()) return {timers_.call_head(now), kNever, {}};
  const auto job = timers_.call_first(now, [this](TaskId timer) { return may_run(timer); });
  return {job, job ? kNever : timers_.next_due(), {}};
}

}  // namespace hotpath
