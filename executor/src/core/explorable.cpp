// SPDX-License-Identifier: Apache-2.0
#include "explorable.hpp"

#include <numeric>
#include <string>

#include "simulation.hpp"

namespace hotpath {

std::int64_t hyperperiod(const TaskSet& set) {
  std::int64_t all = 1;
  for (const Task& task : set.tasks) {
    if (task.kind != TaskKind::timer) continue;
    const std::int64_t period = task.period.count(), common = all / std::gcd(all, period);
    if (common > kLongestInstant.count() / period)
      throw ExplorationRefused("the timers have no common multiple of their periods below 36 years");
    all = common * period;
  }
  return all;
}

const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload) {
  const auto* explored = dynamic_cast<const ExploredScheduler*>(&scheduler);
  if (!explored || !explored->clone() || !workload.clone()) {
    throw ExplorationRefused("an executor with several threads that run jobs is not explored");
  }
  const Platform& p = options.platform;
  const bool own_timers = scheduler.workers().size() > 1;
  if (own_timers && p.cores == 1 && p.wall_clock_work && p.release_cost + p.pass_cost > Duration{}) {
    throw ExplorationRefused("release costs that displace jobs with `work: wall` are not explored");
  }
  double load = 0;
  for (const Task& task : set.tasks) {
    if (task.always_due) throw ExplorationRefused("timer " + task.name + " has a period of 0");
    if (task.kind == TaskKind::timer) load += to_ms(task.wcet) / to_ms(task.period);
  }
  if (load > 1) throw ExplorationRefused("the timers alone overload the thread");
  return *explored;
}

}  // namespace hotpath
