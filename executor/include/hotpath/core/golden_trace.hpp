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
  std::uint64_t count = 0;  ///< Jobs of the task before it.
  Time start{}, finish{};
  Time next_call{};  ///< The timer's next call as read at the start of the job.
  Worker worker = 0;
};

/// A golden trace: what the real ROS 2 stack did with a set of timers, job by job
/// (reference_system/ros2_reference/traces*/SET.EXECUTOR.csv). A line for each timer,
/// `# TASK period_ns N wcet_ns N first_release_ns N`, then one for each job,
/// `TASK,COUNT,START,FINISH,NEXT_CALL` in nanoseconds since the epoch of the run; or, after a header that
/// names a column `thread`, with the worker in place of the next call, which then follows from rcl's rule.
struct GoldenTrace {
  TaskSet set;                  ///< Each timer in a callback group of its own.
  std::vector<GoldenJob> jobs;  ///< By start.
};

/// Whether a file's first line is that of a golden trace.
[[nodiscard]] bool is_golden_trace(std::string_view first_line);

/// Throws InputError.
[[nodiscard]] GoldenTrace read_golden_trace(const std::filesystem::path& file);

}  // namespace hotpath
