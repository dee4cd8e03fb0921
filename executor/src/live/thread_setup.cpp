// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/thread_setup.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <cerrno>
#include <charconv>
#include <cstring>

namespace hotpath {

namespace {

int native_class(ThreadPolicy::Class c) {
  switch (c) {
    case ThreadPolicy::Class::other:
      return SCHED_OTHER;
    case ThreadPolicy::Class::fifo:
      return SCHED_FIFO;
    case ThreadPolicy::Class::rr:
      return SCHED_RR;
  }
  return SCHED_OTHER;
}

std::string list(const std::vector<int>& numbers) {
  std::string text;
  for (const int n : numbers) text += (text.empty() ? "" : ",") + std::to_string(n);
  return text;
}

}  // namespace

std::string to_string(const ThreadPolicy& policy) {
  const std::string name = to_string(policy.scheduling_class);
  return policy.scheduling_class == ThreadPolicy::Class::other ? name
                                                               : name + ":" + std::to_string(policy.priority);
}

std::string to_string(const WorkerThread& thread) {
  return to_string(thread.role) + std::string(" ") + to_string(thread.policy);
}

ThreadPolicy parse_thread_policy(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto scheduling_class = parse<ThreadPolicy::Class>(text.substr(0, colon));
  ThreadPolicy policy;
  if (scheduling_class == ThreadPolicy::Class::other && colon == std::string::npos) return policy;
  if (scheduling_class && scheduling_class != ThreadPolicy::Class::other && colon != std::string::npos) {
    policy.scheduling_class = *scheduling_class;
    const char* end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data() + colon + 1, end, policy.priority);
    if (parsed.ec == std::errc{} && parsed.ptr == end && policy.priority >= 1 && policy.priority <= 99)
      return policy;
  }
  throw std::invalid_argument("thread policy `" + text +
                              "` is not one of other, fifo:N, rr:N with N from 1 to 99");
}

ThreadPolicy apply_thread_policy(const ThreadPolicyRequest& request) {
  sched_param parameters{};
  parameters.sched_priority = request.policy.priority;
  if (sched_setscheduler(0, native_class(request.policy.scheduling_class), &parameters) == 0)
    return request.policy;
  if (request.required) {
    throw ThreadSetupError("the thread policy " + to_string(request.policy) + " was refused (" +
                           std::strerror(errno) +
                           "); run as root, give the user an rtprio limit, or ask for `other`");
  }
  return {};
}

void minimise_timer_slack() { prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL); }

std::vector<int> allowed_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> cpus;
  if (sched_getaffinity(0, sizeof(set), &set) != 0) return cpus;
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
  // The kernel drops processors that do not exist without a word as long as one is left, so ask back.
  const std::vector<int> before = allowed_cpus();
  if (sched_setaffinity(0, sizeof(wanted), &wanted) != 0 || allowed_cpus().size() != cpus.size()) {
    throw ThreadSetupError("cannot run on processors " + list(cpus) + "; this process may use " +
                           list(before));
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
