// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// Bounds under one default executor (Teper, Betz, Guenzel, Ebner, von der Brueggen, Betz, Chen:
/// "End-to-end timing analysis and optimization of multi-executor ROS 2 systems", RTAS 2024),
/// without DDS latencies; in ns.

/// The tasks of `set` in the order in which an executor runs the results of one poll: timers before
/// subscriptions, each in order of creation (rclcpp 26.0.0 allocator_memory_strategy.hpp).
std::vector<TaskId> poll_order(const TaskSet& set);

/// End-to-end latency of `chain`, from source to sink, on an executor that serves all tasks of
/// `set`: the sum of the bounds until start (Lemmas VI.2, VI.4, VI.5) and until finish (Lemma VI.1)
/// of its elements. Timers have a period above 0. Throws AnalysisError for an empty chain.
std::int64_t teper_2024(const TaskSet& set, const std::vector<TaskId>& chain);

/// The bounds of the paper's comparison, for timers only: L_i = W + max(0, T_i - C_i + H_i) + C_i
/// (Equations 15 and 17) of every task. The end-to-end latency is the sum over the chain.
std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks);

}  // namespace hotpath
