// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "entry.hpp"
#include "hotpath/core/job.hpp"
#include "hotpath/core/thread_policy.hpp"
#include "hotpath/core/worker.hpp"
#include "setup.hpp"

/// LTTng events of an executor, which `executor`, an address, identifies within its process. Without
/// LTTng in ros2_tracing's tracetools they do nothing. docs/ros2.md describes their fields.
namespace hotpath::trace {

void executor_init(const void* executor, const Setup& setup);
void executor_thread(const void* executor, Worker worker, WorkerRole role, const ThreadPolicy& policy);
/// The entry has its task's number.
void executor_callback(const void* executor, const Entry& entry);
/// Whether a session records priorities: otherwise the caller need not compute them.
[[nodiscard]] bool priorities_are_recorded();
void executor_priority(const void* executor, TaskId task, std::int64_t level);
void executor_job(const void* executor, const Job& job);
/// After the job, if its entry is a client or a waitable of which rclcpp writes no events.
void executor_end(const void* executor, const Entry& entry, TaskId task);

}  // namespace hotpath::trace
