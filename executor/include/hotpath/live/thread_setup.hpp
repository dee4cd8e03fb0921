// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// The role of a worker's thread and the policy it obtained.
struct WorkerThread {
  WorkerRole role = WorkerRole::executor;
  ThreadPolicy policy;
};
/// `executor other`, `timer_mgmt fifo:90`.
[[nodiscard]] std::string to_string(const WorkerThread& thread);

/// A requested thread policy. `required`: the user asked for it, and a refusal is an error;
/// otherwise it is a default that may be refused.
struct ThreadPolicyRequest {
  ThreadPolicy policy = {};
  bool required = false;
  std::vector<int> processors = {};  ///< Always required; empty: the creating thread's processors.
};

/// A required real-time set-up was refused.
struct ThreadSetupError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Applies the policy and the processors to the calling thread. Returns the policy obtained: the
/// ordinary one if a default was not permitted. Throws ThreadSetupError if a required setting is
/// refused.
[[nodiscard]] ThreadPolicy apply_thread_policy(const ThreadPolicyRequest& request);

/// Gives a policy to a thread of this process, by its kernel id; nothing happens if it has ended.
/// Throws ThreadSetupError if the policy is refused.
void set_thread_policy(int thread, const ThreadPolicy& policy);

/// The policy of a thread of any process, by its kernel id; std::nullopt: it has ended.
[[nodiscard]] std::optional<ThreadPolicy> thread_policy(int thread);
/// The policy of the calling thread.
[[nodiscard]] ThreadPolicy own_thread_policy();

/// The reason for which apply_thread_policy() rejects the request, found by trying it in a separate
/// thread; empty if it succeeds.
[[nodiscard]] std::string refusal(const ThreadPolicyRequest& request);

/// Sets the timer slack of the calling thread to 1 ns (default 50 us), so that sleeps under the
/// ordinary policy end on time.
void minimise_timer_slack();

/// Restricts the calling thread, and threads that it creates later, to these processors. Throws
/// ThreadSetupError with the processors that exist.
void pin_to_cpus(const std::vector<int>& cpus);

/// The processors on which a thread may run; 0: the calling one. Empty if it has ended.
[[nodiscard]] std::vector<int> allowed_cpus(int thread = 0);

/// Locks current and future memory (mlockall). Throws ThreadSetupError with the limit that forbids
/// it.
void lock_memory();

}  // namespace hotpath
