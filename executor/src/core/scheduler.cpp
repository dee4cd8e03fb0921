// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/scheduler.hpp"

namespace hotpath {

void Scheduler::change_task(TaskId, const std::optional<std::int64_t>&, const std::vector<TaskId>&) {}

Turn take_turn(Scheduler& scheduler, Worker worker, Time now) {
  const Effect effect = scheduler.release_timers(worker, now);
  Turn turn{scheduler.decide(worker, now), effect.released};
  turn.decision.wake |= effect.wake;
  turn.decision.wake.erase(worker);
  return turn;
}

}  // namespace hotpath
