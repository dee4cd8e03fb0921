// SPDX-License-Identifier: Apache-2.0
#include "explored_state.hpp"

#include <algorithm>
#include <string>

namespace hotpath {

namespace {

/// Throws ExplorationRefused for several threads that run jobs unless each has a core and only jobs take
/// time.
void check_threads(const TaskSet& set, const Platform& p, std::span<const WorkerRole> roles) {
  const auto threads = static_cast<std::size_t>(std::ranges::count(roles, WorkerRole::executor));
  const std::string several = "for an executor with several threads it ";
  const std::size_t cores = roles.size() > threads && !p.raised_releaser ? threads + 1 : threads;
  if (p.cores < cores)
    throw ExplorationRefused(several + "needs " + std::to_string(cores) + " cores, one each (--cores)");
  if (std::ranges::any_of(kAllCosts, [&](auto cost) { return p.*cost > Duration{}; }))
    throw ExplorationRefused(several + "covers no costs, wake-up latencies or delivery delays");
  for (const Task& task : set.tasks) {
    if (task.release_jitter > Duration{})
      throw ExplorationRefused(several + "does not cover the release jitter of " + task.name);
  }
}

}  // namespace

const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload) {
  const auto* explored = dynamic_cast<const ExploredScheduler*>(&scheduler);
  if (!explored || !explored->clone() || !workload.clone()) {
    throw ExplorationRefused("an executor whose timer thread runs jobs is not explored");
  }
  const auto threads = std::ranges::count(scheduler.workers(), WorkerRole::executor);
  if (threads > 1) check_threads(set, options.platform, scheduler.workers());
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
  if (load > static_cast<double>(threads))
    throw ExplorationRefused(threads > 1 ? "the timers alone overload its threads"
                                         : "the timers alone overload the thread");
  return *explored;
}

}  // namespace hotpath
