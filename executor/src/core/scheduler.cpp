// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/scheduler.hpp"

#include "hotpath/core/timer.hpp"
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

void Scheduler::change_task(TaskId, const std::optional<std::int64_t>&, const std::vector<TaskId>&) {}

void Scheduler::visit_due(const Timer& timer, Time now, const Visitor& visit) {
  if (timer.next_call() > now) return;
  Timer at_the_end = timer;
  visit(at_the_end.call(now), Outcome::queued);
}

void Scheduler::visit_unread(const UnreadSamples& unread, TaskId task, const Visitor& visit) {
  for (std::uint32_t i = 0; i < unread.count(task); ++i) visit(unread.peek(task, i), Outcome::queued);
}

void Scheduler::visit_unfinished(std::span<const Timer> timers, const UnreadSamples& unread, Time now,
                                 const Visitor& visit) {
  for (const Timer& timer : timers) visit_due(timer, now, visit);
  for (TaskId id = 0; id < unread.tasks(); ++id) visit_unread(unread, id, visit);
}

Turn take_turn(Scheduler& scheduler, Worker worker, Time now) {
  const Effect effect = scheduler.release_timers(worker, now);
  Turn turn{scheduler.decide(worker, now), effect.released};
  turn.decision.wake |= effect.wake;
  turn.decision.wake.erase(worker);
  return turn;
}

}  // namespace hotpath
