// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

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
  ThreadPolicy policy = {};
  bool required = false;
  std::vector<int> processors = {};  ///< Always required; empty: those of the creating thread.
};

/// Real-time set-up that was asked for was refused.
struct ThreadSetupError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Gives the calling thread the policy and the processors; returns the policy obtained (the ordinary one when
/// a mere default was not permitted). Throws ThreadSetupError when what is required is refused.
[[nodiscard]] ThreadPolicy apply_thread_policy(const ThreadPolicyRequest& request);

/// What the calling thread has.
[[nodiscard]] ThreadPolicy own_thread_policy();

/// Why apply_thread_policy() refuses it, tried in a thread of its own; empty: it does not.
[[nodiscard]] std::string refusal(const ThreadPolicyRequest& request);

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
