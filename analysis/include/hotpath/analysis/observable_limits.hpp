// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hotpath/analysis/deployment_bounds.hpp"

namespace hotpath {

/// A system whose jobs are observed by events of their starts, ends and publications.
struct ObservedSystem {
  const TaskSet& set;
  std::vector<DeployedThread> threads;     ///< Executors.
  std::vector<std::uint32_t> executor_of;  ///< By task: index into `threads`.
  Platform platform;
  std::vector<std::optional<Duration>> responses = {};  ///< By task: bounds; std::nullopt: none.
  std::vector<bool> always = {};  ///< By subscription: a job of its publisher always publishes for it.
};

// What follows from the bounds (docs/contract.md, "The file"), for any phases and in ns.

/// Most time from start to end of a job, without the jobs of other threads that displace it. Where events
/// do not tell all that displaces it, it is that of the response. std::nullopt: unbounded, or no work.
[[nodiscard]] std::optional<Duration> longest_run(const ObservedSystem& system, TaskId task);

/// Least time from a sample of a subscription to the k-th next, k >= 1; 0 if none is known.
[[nodiscard]] Duration shortest_distance(const ObservedSystem& system, TaskId subscription, std::int64_t k);

/// Most time between two starts of a timer's jobs, or between two publications for a subscription.
[[nodiscard]] std::optional<Duration> longest_distance(const ObservedSystem& system, TaskId task);

/// Whether every sample is taken before as many as the queue holds follow it.
[[nodiscard]] bool loses_nothing(const ObservedSystem& system, TaskId subscription);

/// Whether no other thread of the system keeps a processor from the executor's threads that run jobs.
[[nodiscard]] bool never_waits(const ObservedSystem& system, std::size_t executor);

}  // namespace hotpath
