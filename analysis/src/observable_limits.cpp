// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/observable_limits.hpp"

#include <algorithm>

namespace hotpath {

namespace {

/// Of a job among the work of timer threads.
constexpr Duration kLongest = std::chrono::seconds(100);

bool runs_timers(const DeployedThread& t) {
  return t.executor->traits.timers == TimerHandling::release_and_execute;
}

std::uint32_t threads_of(const DeployedThread& t) { return worker_count(*t.executor, t.scheduling); }

/// Besides its timer thread.
std::uint32_t threads_without_timers(const DeployedThread& t) {
  return threads_of(t) - (t.executor->traits.timers == TimerHandling::polled ? 0 : 1);
}

bool timer_thread_runs(const ObservedSystem& s, TaskId task) {
  return s.set[task].kind == TaskKind::timer && runs_timers(s.threads[s.executor_of[task]]);
}

/// Whether each thread that runs jobs, or each thread at all, has a processor whenever it can run.
bool have_room(const ObservedSystem& s, bool at_all) {
  std::uint32_t count = 0;
  for (const DeployedThread& t : s.threads) {
    if (t.processors.size() < s.platform.cores) return false;
    count += at_all ? threads_of(t) : threads_without_timers(t) + (runs_timers(t) ? 1 : 0);
  }
  return count <= s.platform.cores;
}

/// What keeps a processor from threads that run jobs. Equal real-time threads: only jobs that started
/// before. Told by events: only jobs that start on the only processor of both.
enum class Rivals : std::uint8_t { none, equal, told, untold };

/// Of the executor's timer thread, or of its others.
Rivals rivals_of(const ObservedSystem& s, std::size_t executor, bool timers) {
  if (have_room(s, false)) return Rivals::none;
  const Platform& p = s.platform;
  const bool free = p.longest_dispatch_cost() + p.wait_cost + p.wait_cost_per_entity == Duration::zero();
  const DeployedThread& mine = s.threads[executor];
  const int priority = timers ? mine.timers_priority : mine.priority;
  Rivals all = Rivals::none;
  const auto add = [&](bool exist, int other, bool told) {
    if (exist && other == priority) all = std::max(all, other > 0 ? Rivals::equal : Rivals::untold);
    if (exist && other > priority) all = std::max(all, told ? Rivals::told : Rivals::untold);
  };
  for (std::size_t e = 0; e < s.threads.size(); ++e) {
    const DeployedThread& t = s.threads[e];
    if (std::ranges::find_first_of(t.processors, mine.processors) == t.processors.end()) continue;
    const bool one = t.processors.size() == 1 && mine.processors.size() == 1, own = e == executor;
    add(threads_without_timers(t) > (own && !timers ? 1U : 0U), t.priority, one && free);
    add(runs_timers(t) && !(own && timers), t.timers_priority, one);
  }
  return all;
}

/// Work of the timer thread before a timer's job, or its release.
Duration release_cost(const ObservedSystem& s, TaskId timer) {
  const Platform& p = s.platform;
  return p.release_cost + p.pass_cost + (timer_thread_runs(s, timer) ? p.timer_dispatch_cost : Duration{});
}

/// Of all timers.
Duration release_costs(const ObservedSystem& s) {
  Duration all{};
  for (const TaskId timer : s.set.timers()) all += release_cost(s, timer);
  return all;
}

/// Most time from a timer's timestamp until its timer thread, idle before, has the processor: one that is
/// not raised waits for the end of a time slice.
Duration release_lateness(const ObservedSystem& s) {
  const Duration all = release_costs(s), slice = s.platform.time_slice;
  const bool raised =
      std::ranges::all_of(s.threads, [](const DeployedThread& t) { return t.timers_priority > t.priority; });
  return s.platform.wake_up_latency + (raised ? Duration{} : all + slice * (1 + all / slice));
}

/// The longest run where timer threads displace the job: they release timers, and may run them.
std::optional<Duration> longest_run_below_timer_threads(const ObservedSystem& s, TaskId task) {
  const Duration wcet = s.set[task].wcet, late = release_lateness(s);
  const bool first = s.threads.size() == 1 && timer_thread_runs(s, task);
  if (first || release_costs(s) == Duration::zero()) return wcet;
  const bool real_time = std::ranges::any_of(s.threads, [](const auto& t) { return t.priority > 0; });
  if (s.threads.size() > 1 && real_time)
    return s.responses[task];       // how long their jobs displace it is unknown
  for (Duration window = wcet;;) {  // to its end, with the jobs of timer threads
    Duration run = wcet, jobs{};
    for (const TaskId timer : s.set.timers()) {
      const Task& of = s.set[timer];
      const std::int64_t releases = (window + late + of.release_jitter) / of.period + 1;
      run += releases * release_cost(s, timer);
      if (timer_thread_runs(s, timer)) jobs += releases * of.wcet;
    }
    if (run + jobs == window) return run;
    if (run + jobs > kLongest) return s.responses[task];
    window = run + jobs;
  }
}

/// The only task that publishes the samples of a subscription, if its response is bounded.
std::optional<TaskId> publisher_of(const ObservedSystem& s, TaskId subscription) {
  std::optional<TaskId> only;
  for (TaskId task = 0; task < s.set.size(); ++task) {
    if (std::ranges::count(s.set[task].feeds, subscription) == 0) continue;
    if (only || !s.responses[task]) return std::nullopt;
    only = task;
  }
  return only;
}

}  // namespace

std::optional<Duration> longest_run(const ObservedSystem& s, TaskId task) {
  const Duration wcet = s.set[task].wcet;
  if (wcet == Duration::zero()) return std::nullopt;
  if (rivals_of(s, s.executor_of[task], timer_thread_runs(s, task)) == Rivals::untold)
    return s.responses[task];
  return have_room(s, true) ? wcet : longest_run_below_timer_threads(s, task);
}

/// The only publisher publishes from its timestamp to its response bound.
Duration shortest_distance(const ObservedSystem& s, TaskId subscription, std::int64_t k) {
  const auto publisher = publisher_of(s, subscription);
  if (!publisher) return Duration::zero();
  const Task& of = s.set[*publisher];
  const Duration before = of.kind == TaskKind::timer ? k * of.period : shortest_distance(s, *publisher, k);
  return std::max(Duration::zero(), before - *s.responses[*publisher]);
}

bool loses_nothing(const ObservedSystem& s, TaskId subscription) {
  const auto& bound = s.responses[subscription];
  return bound && shortest_distance(s, subscription, s.set[subscription].depth) >= *bound;
}

std::optional<Duration> longest_distance(const ObservedSystem& s, TaskId task) {
  const Task& of = s.set[task];
  if (of.kind == TaskKind::timer) {
    const auto& bound = s.responses[task];
    return bound && *bound <= of.period ? std::optional(of.period + *bound) : std::nullopt;
  }
  const auto publisher = publisher_of(s, task);
  if (!publisher || !s.always[task]) return std::nullopt;
  if (s.set[*publisher].kind == TaskKind::timer) return longest_distance(s, *publisher);
  const auto before = loses_nothing(s, *publisher) ? longest_distance(s, *publisher) : std::nullopt;
  return before ? std::optional(*before + *s.responses[*publisher]) : std::nullopt;
}

bool never_waits(const ObservedSystem& s, std::size_t executor) {
  return rivals_of(s, executor, false) == Rivals::none;
}

}  // namespace hotpath
