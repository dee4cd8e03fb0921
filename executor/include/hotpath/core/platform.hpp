// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// How the operating system schedules a worker's thread in a simulation.
struct SimulatedThread {
  int priority = 0;  ///< SCHED_FIFO: 1 to 99, larger first. 0: the ordinary policy, below all of these.
  int nice = 0;      ///< Ordinary policy: -20 to 19; scales the time slice.
  std::uint64_t processors = ~std::uint64_t{0};  ///< Bit i: the thread may run on core i.
};

/// The simulated machine: identical cores, a preemptive operating system with fixed thread
/// priorities, and the costs of releasing and dispatching. All costs are zero by default.
///
/// The highest-priority workers with work occupy the cores on which they may run. A running job
/// displaced by a worker of higher priority continues later. Among workers of equal priority above
/// 0, the first to arrive runs (SCHED_FIFO). A worker of the ordinary policy that arrives later
/// waits until a running one has had the core for a time slice since it last waited: SCHED_RR's
/// round robin, and close to Linux's behaviour. A worker that holds its executor's lock inherits
/// the priority of the workers waiting for it.
struct Platform {
  unsigned cores = 1;           ///< >= 1; above 64, further cores have no effect.
  bool raised_releaser = true;  ///< Timer management worker outranks executor workers (the paper).
  Duration time_slice = std::chrono::milliseconds(3);  ///< > 0; near Linux's default (EEVDF: 0.7 to 2.8 ms).

  /// delta: occupies the releaser's core once per released timer (paper, Section V-B). The releaser
  /// holds the scheduler's lock meanwhile, so a release becomes visible only after its cost has
  /// been paid: timer by timer for the stock releaser, all together for the paper's. `Job::release`
  /// is the instant at which the timer was read, before the cost.
  Duration release_cost{};
  /// k: paid once per pass of the releaser, before its first release; a pass ends when its worker
  /// sleeps or runs a job.
  Duration pass_cost{};
  /// Occupies a worker's core between a decision that yields a job of a timer, or of a subscription,
  /// and the start of that job.
  Duration timer_dispatch_cost{}, subscription_dispatch_cost{};
  /// Paid before the dispatch if the decision needed a new wait: the cost to build a wait set and
  /// to scan it when rcl_wait returns, per wait and per entity. No other worker decides meanwhile.
  /// A wait in which the worker slept costs only the wake-up. A worker that shares a wait set with
  /// others pays when its wait begins, also if it then sleeps.
  Duration wait_cost{}, wait_cost_per_entity{};
  /// Entities in every wait besides the tasks: the parameter services, guard conditions and
  /// waitables of each rclcpp node. Applies to a single executor; SimulatedExecutor has its own
  /// number.
  std::uint32_t other_entities = 0;
  /// From a publication to the arrival of the sample. The publisher's core is not occupied.
  Duration delivery_delay{};
  /// From the instant at which a sleeping worker is woken until it competes for a core.
  Duration wake_up_latency{};

  /// Jobs work until a wall-clock instant, like the paper's task sets: time while a job is
  /// displaced counts as executed. Otherwise the amount of work is fixed, and displacement prolongs
  /// the job.
  bool wall_clock_work = false;

  [[nodiscard]] constexpr Duration dispatch_cost(TaskKind kind) const {
    return kind == TaskKind::timer ? timer_dispatch_cost : subscription_dispatch_cost;
  }
  /// Of any job, at most.
  [[nodiscard]] constexpr Duration longest_dispatch_cost() const {
    return std::max(timer_dispatch_cost, subscription_dispatch_cost);
  }
  constexpr void set_dispatch_costs(Duration cost) {
    timer_dispatch_cost = subscription_dispatch_cost = cost;
  }
  /// All but the cores.
  constexpr void set_costs(const ReferenceCosts& costs) {
    set_dispatch_costs(costs.dispatch);
    wait_cost = costs.wait;
    wait_cost_per_entity = costs.wait_per_entity;
    wake_up_latency = costs.wake_up;
  }
  friend bool operator==(const Platform&, const Platform&) = default;
};

/// All costs, delays and latencies of a platform.
inline constexpr std::array kAllCosts = {
    &Platform::release_cost,        &Platform::pass_cost,
    &Platform::timer_dispatch_cost, &Platform::subscription_dispatch_cost,
    &Platform::wait_cost,           &Platform::wait_cost_per_entity,
    &Platform::delivery_delay,      &Platform::wake_up_latency};

/// The executor's default thread priorities of a live run; all other values are Platform's
/// defaults.
inline Platform default_platform(const ExecutorEntry& executor) {
  Platform platform;
  platform.raised_releaser = executor.traits.raises_timer_thread;
  return platform;
}

/// Entities of an rclcpp node that its executor waits for besides timers and subscriptions: six
/// parameter services, the subscription to parameter events, and the guard condition of the node's
/// callback group.
inline constexpr std::uint32_t kEntitiesOfANode = 8;

/// The reference machine with this executor's costs under the real ROS 2 stack, for a system of
/// `nodes` nodes.
inline Platform reference_platform(const ExecutorEntry& executor, std::uint32_t nodes) {
  Platform platform;
  platform.other_entities = kEntitiesOfANode * nodes;
  platform.cores = executor.traits.reference.cores;
  platform.set_costs(executor.traits.reference);
  return platform;
}

}  // namespace hotpath
