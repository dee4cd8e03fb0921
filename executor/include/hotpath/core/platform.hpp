// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// How the operating system schedules a worker's thread in a simulation.
struct SimulatedThread {
  int priority = 0;  ///< SCHED_FIFO: 1 to 99, the larger first. 0: the ordinary policy, below all of these.
  int nice = 0;      ///< Ordinary policy, -20 to 19: scales the time slice.
  std::uint64_t processors = ~std::uint64_t{0};  ///< Bit i: it may run on core i.
};

/// The machine under a simulation: identical cores, a preemptive operating system with fixed thread
/// priorities, and what releasing and dispatching cost there. All costs are zero by default.
///
/// The workers of highest priority among those that have something to do occupy the cores on which they may
/// run; a running job that a worker of higher priority displaces goes on later. Among workers of equal
/// priority above 0 the one that came first runs (SCHED_FIFO). One of the ordinary policy that comes later
/// waits until a running one has had the core for a time slice since it last waited: the round robin of
/// SCHED_RR, and close to what Linux does. A worker that holds its executor's lock has the priority of those
/// that wait for it.
struct Platform {
  unsigned cores = 1;           ///< >= 1; more than 64 are as good as 64.
  bool raised_releaser = true;  ///< Timer management worker above executor workers (the paper), or equal.
  Duration time_slice = std::chrono::milliseconds(3);  ///< > 0; near Linux's default (EEVDF: 0.7 to 2.8 ms).

  /// delta: occupies the releaser's core once per released timer (paper, Section V-B). The scheduler's lock
  /// is held meanwhile, so that nobody sees a release before it has been paid for: the stock releaser's after
  /// delta each, the paper's all together. `Job::release` is the instant at which the timer was read, before
  /// the cost.
  Duration release_cost{};
  /// k: once per pass of the releaser, in front of its first release; a pass ends when its worker sleeps or
  /// runs a job.
  Duration pass_cost{};
  /// Occupies a worker's core between a decision that yields a job and the start of that job.
  Duration dispatch_cost{};
  /// In front of the dispatch, when the decision needed a new wait: to build a wait set and to scan it when
  /// rcl_wait returns, once and for each entity in it. No other worker decides meanwhile. The return of a
  /// wait in which the worker slept costs the wake-up alone.
  Duration wait_cost{}, wait_cost_per_entity{};
  /// Entities in every wait beside the tasks that it waits for: the services of parameters, guard conditions
  /// and waitables that each of rclcpp's nodes has. For one executor; several have their own numbers.
  std::uint32_t other_entities = 0;
  /// From a publication to the arrival of the sample. The publisher's core is not occupied.
  Duration delivery_delay{};
  /// From the instant at which a sleeping worker is to wake until it competes for a core.
  Duration wake_up_latency{};

  /// Jobs work until a wall-clock instant, like the paper's task sets: time during which a job is displaced
  /// counts as executed. Otherwise the work is fixed and displacement prolongs the job.
  bool wall_clock_work = false;
};

/// Thread priorities as the executor has them in a live run by default; everything else as in Platform.
inline Platform default_platform(const ExecutorEntry& executor) {
  Platform platform;
  platform.raised_releaser = executor.traits.raises_timer_thread;
  return platform;
}

/// Entities of a node of rclcpp that its executor waits for beside its timers and subscriptions: six services
/// of parameters, the subscription to parameter events, the guard condition of its callback group.
inline constexpr std::uint32_t kEntitiesOfANode = 8;

/// The reference machine under the real ROS 2 stack, with what this executor cost there with so many nodes.
inline Platform reference_platform(const ExecutorEntry& executor, std::uint32_t nodes) {
  Platform platform;
  platform.wait_cost = executor.traits.reference.wait;
  platform.wait_cost_per_entity = executor.traits.reference.wait_per_entity;
  platform.other_entities = kEntitiesOfANode * nodes;
  platform.cores = executor.traits.reference.cores;
  platform.dispatch_cost = executor.traits.reference.dispatch;
  platform.wake_up_latency = executor.traits.reference.wake_up;
  return platform;
}

}  // namespace hotpath
