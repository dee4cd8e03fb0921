// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

namespace {

/// How often jobs of one thread met jobs of another thread on one processor.
struct Meetings {
  std::uint32_t within = 0;  ///< Ran within a job of the other thread: preempted it.
  std::uint32_t waited = 0;  ///< Became ready during a job of the other thread and began after it.
  std::uint32_t sliced = 0;  ///< Became ready during a job of the other thread and began later during it.
};

/// A thread that preempts another one begins sooner; a time slice ends later.
constexpr Duration kPreempts = std::chrono::microseconds(500);

/// After this time a thread that shares a wait set sleeps, even if its wait began twice.
constexpr Duration kBeginning = std::chrono::microseconds(500);

/// Few exceptions do not count: threads of the ordinary policy also preempt each other, and take turns.
bool takes_turns(const Meetings& of) { return of.sliced > 3 && 10 * of.sliced > of.within; }
bool is_above(const Meetings& of, const Meetings& other) {
  return of.within > 3 && of.within > 10 * other.within && !takes_turns(of);
}
bool waits_for(const Meetings& of, const Meetings& other) {
  return of.waited > 4 && of.waited > 20 * of.within && !takes_turns(other);
}

/// A kind of job with fewer dispatches than this has the median of all dispatches.
constexpr std::size_t kEnough = 100;

/// Times before the starts of jobs, with the kind of each job.
using Gaps = std::vector<std::pair<TaskKind, Duration>>;

MeasuredCost cost_of(const Gaps& gaps, std::optional<TaskKind> kind = {}) {
  std::vector<Duration> samples;
  for (const auto& [of, gap] : gaps)
    if (!kind || of == *kind) samples.push_back(gap);
  if (samples.empty()) return {};
  std::ranges::sort(samples);
  const auto at = [&](std::size_t percent) { return samples[(samples.size() - 1) * percent / 100]; };
  return {samples.size(), at(50), at(90)};
}

/// Leaves out the dispatch of each job, which may be known from other executors only.
Gaps without_dispatch(Gaps gaps, const RecordedCosts& costs, const MeasuredCost& elsewhere) {
  for (auto& [kind, gap] : gaps) {
    const MeasuredCost& own = costs.dispatch_of(kind);
    gap = std::max(Duration::zero(), gap - (own.n == 0 ? elsewhere : own).median);
  }
  return gaps;
}

RecordedCosts costs_of(const Gaps& dispatch, Gaps wait, Gaps wake_up, bool two_wake_ups,
                       const MeasuredCost& elsewhere) {
  RecordedCosts costs;
  costs.dispatch = cost_of(dispatch);
  costs.timer_dispatch = cost_of(dispatch, TaskKind::timer);
  costs.subscription_dispatch = cost_of(dispatch, TaskKind::subscription);
  costs.wait = cost_of(without_dispatch(std::move(wait), costs, elsewhere));
  wake_up = without_dispatch(std::move(wake_up), costs, elsewhere);
  for (auto& [kind, late] : wake_up)
    if (kind == TaskKind::timer && two_wake_ups) late /= 2;
  costs.wake_up = cost_of(wake_up);
  costs.timer_wake_up = cost_of(wake_up, TaskKind::timer);
  costs.delivery = cost_of(wake_up, TaskKind::subscription);
  return costs;
}

}  // namespace

Displacement recorded_displacement(const tracing::System& system, const RecordedWindow& window) {
  const std::size_t threads = system.threads.size();
  Displacement displacement{std::vector<Duration>(window.jobs.size()), std::vector<int>(threads, 0), {}, {}};
  for (const tracing::Thread& thread : system.threads)
    displacement.processors.push_back(usual_processors(thread));
  std::vector<std::vector<Meetings>> met(threads, std::vector<Meetings>(threads));
  std::map<std::int32_t, std::vector<std::size_t>> open;                // by processor
  std::map<std::int32_t, std::map<std::uint32_t, std::size_t>> latest;  // by processor and thread
  std::vector<Time> idle_since(threads, Time::min());
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const tracing::Job& job = window.jobs[i];
    if (!job.ended) continue;
    displacement.own[i] = job.finish - job.start;
    std::vector<std::size_t>& others = open[job.processor];
    std::erase_if(others, [&](std::size_t o) { return window.jobs[o].finish <= job.start; });
    // Only the innermost job had the processor.
    for (auto outer = others.rbegin(); outer != others.rend(); ++outer) {
      const tracing::Job& displaced = window.jobs[*outer];
      if (displaced.thread == job.thread || displaced.finish < job.finish) continue;
      displacement.own[*outer] -= job.finish - job.start;
      ++met[job.thread][displaced.thread].within;
      break;
    }
    others.push_back(i);
    if (window.records[i].job.task != kNoTask) {
      const Time ready = window.records[i].job.timestamp;
      for (const auto& [thread, last] : latest[job.processor]) {
        const tracing::Job& before = window.jobs[last];
        const bool during = thread != job.thread && before.start < ready && ready < before.finish;
        if (!during || idle_since[job.thread] >= ready) continue;
        Meetings& meetings = met[job.thread][thread];
        meetings.waited += before.finish <= job.start;
        meetings.sliced += before.finish > job.start && job.start > ready + kPreempts;
      }
    }
    latest[job.processor][job.thread] = i;
    idle_since[job.thread] = std::max(idle_since[job.thread], job.finish);
  }
  constexpr int kMostLevels = 9;
  for (std::size_t round = 0; round < threads; ++round) {
    for (std::size_t a = 0; a < threads; ++a) {
      for (std::size_t b = 0; b < threads; ++b) {
        int& level = displacement.level[a];
        if (is_above(met[a][b], met[b][a]))
          level = std::max(level, std::min(displacement.level[b] + 1, kMostLevels));
        if (waits_for(met[b][a], met[a][b])) level = std::max({level, displacement.level[b], 1});
      }
    }
  }
  follow_time_slices(system, window, displacement);
  return displacement;
}

MeasuredCost RecordedCosts::dispatch_of(TaskKind kind) const {
  const MeasuredCost& own = kind == TaskKind::timer ? timer_dispatch : subscription_dispatch;
  return own.n < kEnough ? dispatch : own;
}

RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                             const RecordedExecutor& executor, const ExecutorEntry& entry,
                             const MeasuredCost& elsewhere) {
  std::vector<std::size_t> place(graph.tasks.set.size());
  for (TaskId id = 0; id < place.size(); ++id)
    place[id] = entry.traits.runs_first == graph.tasks.set[id].kind ? id : id + place.size();
  const bool wait_set = entry.traits.family == Family::wait_set;
  const bool waits_recorded = std::ranges::any_of(
      window.jobs, [&](const tracing::Job& job) { return job.waited && executor.has(job.thread); });
  const bool shares_waits = wait_set && entry.traits.many_workers;
  // A timer's releaser wakes the thread that runs its job.
  const TimerHandling timers = entry.traits.timers;
  const bool two_wake_ups = timers == TimerHandling::release_only || timers == TimerHandling::marked_ready;
  std::map<std::int32_t, Time> busy_until;        // by processor: end of its earlier jobs
  std::map<std::uint32_t, std::size_t> previous;  // by thread
  std::map<std::uint32_t, Time> group_until;      // by callback group: end of its earlier jobs
  Gaps dispatch, wait, wake_up;
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    if (i > 0 && window.jobs[i - 1].ended) {
      Time& until = busy_until[window.jobs[i - 1].processor];
      until = std::max(until, window.jobs[i - 1].finish);
    }
    const tracing::Job& job = window.jobs[i];
    if (!job.ended || !executor.has(job.thread)) continue;
    const auto [before, is_first] = previous.try_emplace(job.thread, i);
    const tracing::Job& last = window.jobs[before->second];
    const TaskId last_task = window.records[std::exchange(before->second, i)].job.task;
    const TaskId task = window.records[i].job.task;
    if (task == kNoTask) continue;
    const Time timestamp = window.records[i].job.timestamp;
    Time& of_group = group_until[graph.tasks.set[task].group];
    const Time group_free = std::exchange(of_group, std::max(of_group, job.finish));
    if (is_first) continue;
    // It waited for its callback group, which another thread served.
    if (group_free > std::max(timestamp, last.finish)) continue;
    const TaskKind kind = graph.tasks.set[task].kind;
    const Duration gap = job.start - last.finish;
    if (gap < Duration::zero()) continue;  // nested jobs
    if (timestamp <= last.finish) {
      const bool new_round = last_task != kNoTask && place[task] <= place[last_task];
      const bool waited = wait_set && (waits_recorded ? job.waited : new_round);
      (waited ? wait : dispatch).emplace_back(kind, gap);
    } else {
      // Another job on the processor delayed it, not the wake-up.
      if (busy_until[job.processor] > timestamp) continue;
      // The beginning wait noticed it.
      if (shares_waits && timestamp < last.finish + kBeginning) continue;
      wake_up.emplace_back(kind, job.start - timestamp);
    }
  }
  return costs_of(dispatch, std::move(wait), std::move(wake_up), two_wake_ups, elsewhere);
}

}  // namespace hotpath::imports
