// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// The delivery of a publication to a subscription on another executor.
struct DdsDelivery {
  std::size_t to = 0;        ///< Position of the subscription.
  std::int64_t latency = 0;  ///< Nanoseconds, >= 0.
};

/// One callback of a system of default (wait set) executors, in the model of the RTAS 2024
/// analysis.
struct ExecutorCallback {
  std::string name;
  TaskId id = kNoTask;
  TaskKind kind = TaskKind::timer;
  std::int64_t wcet = 0;                ///< Nanoseconds, >= 0.
  std::int64_t period = 0;              ///< Timers: >= 0; 0: ready at every poll. Subscriptions: unused.
  std::uint32_t executor = 0;           ///< Index of the executor; its callbacks are polled together.
  std::uint32_t depth = 1;              ///< Subscriptions: DDS queue depth, >= 1.
  bool asynchronous = false;            ///< Publishing does not delay the publisher.
  std::vector<DdsDelivery> deliveries;  ///< To subscriptions on other executors only.
};

/// Callbacks in the order in which an executor runs the results of one poll.
using ExecutorCallbacks = std::vector<ExecutorCallback>;

/// The tasks of `set` on one default executor: timers before subscriptions, each in order of
/// creation (rclcpp 26.0.0 allocator_memory_strategy.hpp), without DDS latencies.
ExecutorCallbacks executor_callbacks(const TaskSet& set);

/// Throws AnalysisError for times out of range, an empty chain, or a chain or delivery with an
/// unknown callback.
void check_callbacks(const ExecutorCallbacks& callbacks, const TaskChain& chain, std::string_view method);

}  // namespace hotpath
