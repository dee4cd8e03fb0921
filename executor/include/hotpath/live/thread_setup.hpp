// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// A thread's scheduling class: the ordinary policy, or SCHED_FIFO / SCHED_RR with a priority in [1, 99].
struct ThreadPolicy {
  enum class Class : std::uint8_t { other, fifo, rr };
  Class scheduling_class = Class::other;
  int priority = 0;
  friend bool operator==(const ThreadPolicy&, const ThreadPolicy&) = default;
};

constexpr auto enum_texts(ThreadPolicy::Class) {
  return std::to_array<EnumText<ThreadPolicy::Class>>({{ThreadPolicy::Class::other, "other"},
                                                       {ThreadPolicy::Class::fifo, "fifo"},
                                                       {ThreadPolicy::Class::rr, "rr"}});
}

/// `other`, `fifo:80`, `rr:10`.
[[nodiscard]] std::string to_string(const ThreadPolicy& policy);
/// Throws std::invalid_argument that says what would be right.
[[nodiscard]] ThreadPolicy parse_thread_policy(const std::string& text);

/// What a worker's thread is for and the policy it got.
struct WorkerThread {
  WorkerRole role = WorkerRole::executor;
  ThreadPolicy policy;
};
/// `executor other`, `timer_mgmt fifo:90`.
[[nodiscard]] std::string to_string(const WorkerThread& thread);

/// A policy that is wanted for a thread. `required`: the user asked for it and not getting it is an error;
/// otherwise it is a default that may be refused.
struct ThreadPolicyRequest {
  ThreadPolicy policy;
  bool required = false;
};

/// Real-time set-up that was asked for was refused.
struct ThreadSetupError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Gives the calling thread the policy; returns the one obtained (the ordinary policy when a mere default was
/// not permitted). Throws ThreadSetupError when a required one is refused.
[[nodiscard]] ThreadPolicy apply_thread_policy(const ThreadPolicyRequest& request);

/// Timer slack of the calling thread to 1 ns, so that sleeps under the ordinary policy end on time (default
/// 50 us).
void minimise_timer_slack();

/// Restricts the calling thread, and those it creates later, to these processors. Throws ThreadSetupError
/// that names the processors that exist.
void pin_to_cpus(const std::vector<int>& cpus);

/// Processors that the calling thread may run on.
[[nodiscard]] std::vector<int> allowed_cpus();

/// mlockall(current and future). Throws ThreadSetupError with the limit that forbids it.
void lock_memory();

}  // namespace hotpath
