// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/thread_setup.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

namespace hotpath {

namespace {

int native_class(ThreadPolicy::Class c) {
  constexpr int kNative[] = {SCHED_OTHER, SCHED_BATCH, SCHED_IDLE, SCHED_FIFO, SCHED_RR, SCHED_DEADLINE};
  return kNative[static_cast<std::size_t>(c)];
}

/// Argument of Linux's sched_setattr(2); glibc 2.36 declares neither the functions nor the
/// structure.
struct SchedulingAttributes {
  std::uint32_t size, policy;
  std::uint64_t flags;
  std::int32_t nice;
  std::uint32_t priority;
  std::uint64_t runtime, deadline, period;
};

bool set_budget(int thread, const ThreadPolicy& policy) {
  SchedulingAttributes attributes{};
  attributes.size = sizeof attributes;
  attributes.policy = SCHED_DEADLINE;
  attributes.flags = 1;  // SCHED_FLAG_RESET_ON_FORK: a thread of this policy may create no other
  attributes.runtime = static_cast<std::uint64_t>(policy.runtime.count());
  attributes.deadline = static_cast<std::uint64_t>(policy.deadline.count());
  attributes.period = static_cast<std::uint64_t>(policy.period.count());
  return syscall(SYS_sched_setattr, thread, &attributes, 0) == 0;
}

/// `thread`: its kernel id; 0 is the calling thread.
bool set_policy(int thread, const ThreadPolicy& policy) {
  if (policy.scheduling_class == ThreadPolicy::Class::deadline) return set_budget(thread, policy);
  sched_param parameters{};
  parameters.sched_priority = policy.ordinary() ? 0 : policy.priority;
  if (sched_setscheduler(thread, native_class(policy.scheduling_class), &parameters) != 0) return false;
  // In Linux each thread has its own nice value.
  return !policy.ordinary() || policy.priority == 0 ||
         setpriority(PRIO_PROCESS, static_cast<id_t>(thread), policy.priority) == 0;
}

[[noreturn]] void refuse(const ThreadPolicy& policy, int error) {
  const bool deadline = policy.scheduling_class == ThreadPolicy::Class::deadline;
  throw ThreadSetupError("the thread policy " + to_string(policy) + " was refused (" + std::strerror(error) +
                         "); " +
                         (deadline ? "run as root on all processors (no --cpus), with budgets that add up "
                                     "to less than sched_rt_runtime_us grants, or ask for `other`"
                                   : "run as root, give the user an rtprio (or nice) limit, or ask for "
                                     "`other`"));
}

}  // namespace

std::string to_string(const WorkerThread& thread) {
  return to_string(thread.role) + std::string(" ") + to_string(thread.policy);
}

ThreadPolicy apply_thread_policy(const ThreadPolicyRequest& request) {
  if (!request.processors.empty()) pin_to_cpus(request.processors);
  if (set_policy(0, request.policy)) return request.policy;
  if (request.required) refuse(request.policy, errno);
  return {};
}

void set_thread_policy(int thread, const ThreadPolicy& policy) {
  if (!set_policy(thread, policy) && errno != ESRCH) refuse(policy, errno);
}

std::optional<ThreadPolicy> thread_policy(int thread) {
  SchedulingAttributes attributes{};
  ThreadPolicy policy;
  if (syscall(SYS_sched_getattr, thread, &attributes, sizeof attributes, 0) != 0) return std::nullopt;
  for (const auto& c : enum_texts(ThreadPolicy::Class{})) {
    if (native_class(c.value) == static_cast<int>(attributes.policy)) policy.scheduling_class = c.value;
  }
  if (policy.scheduling_class == ThreadPolicy::Class::deadline) {
    const auto duration = [](std::uint64_t ns) { return Duration(static_cast<std::int64_t>(ns)); };
    policy.runtime = duration(attributes.runtime);
    policy.deadline = duration(attributes.deadline);
    policy.period = duration(attributes.period);
  } else {
    policy.priority = policy.ordinary() ? attributes.nice : static_cast<int>(attributes.priority);
  }
  return policy;
}

ThreadPolicy own_thread_policy() { return thread_policy(0).value_or(ThreadPolicy{}); }

std::string refusal(const ThreadPolicyRequest& request) {
  std::string reason;
  std::thread([&] {
    try {
      static_cast<void>(apply_thread_policy(request));
    } catch (const ThreadSetupError& error) {
      reason = error.what();
    }
  }).join();
  return reason;
}

void minimise_timer_slack() { prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL); }

std::vector<int> allowed_cpus(int thread) {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (sched_getaffinity(thread, sizeof(set), &set) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  }
  return cpus;
}

void pin_to_cpus(const std::vector<int>& cpus) {
  cpu_set_t wanted;
  CPU_ZERO(&wanted);
  for (const int cpu : cpus) {
    if (cpu >= 0 && cpu < CPU_SETSIZE) CPU_SET(cpu, &wanted);
  }
  // The kernel silently drops processors that do not exist as long as one exists, so check the
  // result.
  const std::vector<int> before = allowed_cpus();
  if (sched_setaffinity(0, sizeof(wanted), &wanted) != 0 || allowed_cpus().size() != cpus.size()) {
    throw ThreadSetupError("cannot run on processors " + joined(cpus, ",") + "; this process may use " +
                           joined(before, ","));
  }
}

void lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return;
  const int error = errno;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  throw ThreadSetupError("locking memory was refused (" + std::string(std::strerror(error)) +
                         "); the limit is " + std::to_string(limit.rlim_cur / 1024) +
                         " KiB: raise it (ulimit -l), run as root, or leave the option out");
}

}  // namespace hotpath
