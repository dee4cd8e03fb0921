// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/scheduler.hpp"

#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

void Scheduler::visit_unfinished(std::span<const Timer> timers, const UnreadSamples& unread, Time now,
                                 const Visitor& visit) {
  for (const Timer& t : timers) {
    if (!t.is_ready(now)) continue;
    Timer at_the_end = t;
    visit(at_the_end.call(now), Outcome::queued);
  }
  for (TaskId id = 0; id < unread.tasks(); ++id) {
    for (std::uint32_t i = 0; i < unread.count(id); ++i) visit(unread.peek(id, i), Outcome::queued);
  }
}

Turn take_turn(Scheduler& scheduler, Worker worker, Time now) {
  const Effect effect = scheduler.release_timers(worker, now);
  Turn turn{scheduler.decide(worker, now), effect.released};
  turn.decision.wake |= effect.wake;
  turn.decision.wake.erase(worker);
  return turn;
}

}  // namespace hotpath
