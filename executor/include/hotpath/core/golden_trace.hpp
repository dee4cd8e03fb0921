// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "hotpath/core/task.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// One job of the real ROS 2 stack.
struct GoldenJob {
  TaskId task = kNoTask;
  std::uint64_t count = 0;  ///< Earlier jobs of the task.
  Time start{}, finish{};
  Time next_call{};  ///< The timer's next call, read at the start of the job.
  Worker worker = 0;
};

/// A golden trace: the jobs of a set of timers under the real ROS 2 stack
/// (reference_system/ros2_reference/traces*/SET.EXECUTOR.csv). The file has a line for each timer,
/// `# TASK period_ns N wcet_ns N first_release_ns N`, then a line for each job,
/// `TASK,COUNT,START,FINISH,NEXT_CALL` in nanoseconds since the epoch of the run. If a header names
/// a column `thread`, each row has the worker in place of the next call, which then follows from
/// rcl's rule.
struct GoldenTrace {
  TaskSet set;                  ///< Each timer has its own callback group.
  std::vector<GoldenJob> jobs;  ///< Sorted by start.
};

/// Whether this is the first line of a golden trace.
[[nodiscard]] bool is_golden_trace(std::string_view first_line);

/// Throws InputError.
[[nodiscard]] GoldenTrace read_golden_trace(const std::filesystem::path& file);

/// The tasks of a schedule's jobs, in the order of their starts.
using JobOrder = std::vector<TaskId>;

/// Twice the length of the longest common subsequence divided by the sum of both lengths: 1 for the
/// same order, and an upper bound of the ratio of Python's difflib. Two empty orders are equal.
/// Takes time proportional to the product of the lengths.
[[nodiscard]] double similarity(const JobOrder& a, const JobOrder& b);

/// Replaces every task by the first task with the same kind and period, so that comparisons ignore
/// the order among tasks of equal period.
[[nodiscard]] JobOrder by_period(JobOrder order, const TaskSet& set);

}  // namespace hotpath
