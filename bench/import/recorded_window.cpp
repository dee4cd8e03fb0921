// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_window.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::kCreationEvent, tracing::kIdleThread;

/// With more releases, and more per job, the trace's clock must have jumped.
constexpr double kManyReleases = 1e6, kReleasesPerJob = 1e3;

/// A sample may stay unread for this many jobs of its publisher.
constexpr std::size_t kRemembered = 1024;

/// The instant nearest to `about` that whole periods separate from `due`.
Time on_grid(Time about, Time due, Duration period) {
  const auto apart = static_cast<double>((due - about).count()) / static_cast<double>(period.count());
  return due - std::llround(apart) * period;
}

/// The timers of the system, without those of the node `outside`.
std::vector<TaskId> timers_of(const RecordedGraph& graph) {
  std::vector<TaskId> timers = graph.tasks.set.timers();
  std::erase_if(timers, [&](TaskId id) { return graph.callback_of[id] == kNone; });
  return timers;
}

/// The task's timer before its first call.
Timer timer_of(TaskId id, const RecordedGraph& graph, const RecordedTimers& timers) {
  const Task& task = graph.tasks.set[id];
  return {id, task, timers.first[id] - task.phase};
}

/// By task: how far a job may start before the timer's first release, moved by whole periods, if the executor
/// calls the timer when the job starts. The jobs of idle threads tell, since they start when they are due.
std::vector<Duration> most_ahead(const RecordedGraph& graph, const RecordedTimers& timers,
                                 std::span<const tracing::Job> jobs) {
  std::vector<Duration> most(timers.first.size());
  std::map<std::uint32_t, Time> free;  // by thread
  for (const tracing::Job& job : jobs) {
    const Time since = std::exchange(free[job.thread], job.ended ? job.finish : job.start);
    const TaskId id = graph.task(job.ref);
    if (id == kNoTask || graph.tasks.set[id].kind != TaskKind::timer || job.start - since < kIdleThread)
      continue;
    const Duration period = graph.tasks.set[id].period;
    const Duration ahead = (period + (timers.first[id] - job.start) % period) % period;
    most[id] = std::max(most[id], kIdleThread + (ahead > kCreationEvent ? Duration::zero() : ahead));
  }
  std::ranges::replace(most, Duration::zero(), Duration(kCreationEvent));
  return most;
}

/// The creation plus the period, or the grid of the first instant that the executor states.
Time first_release(const tracing::Callback& callback, const std::vector<const tracing::Job*>& jobs) {
  const Time created = callback.created + callback.period;
  const auto stated =
      std::ranges::find_if(jobs, [](const tracing::Job* j) { return j->timestamp != Time{}; });
  if (stated == jobs.end() || (*stated)->timestamp <= Time{}) return created;
  return on_grid(created, (*stated)->timestamp, callback.period);
}

/// Moves the first release of a timer earlier where jobs demand it, and finds out who calls it.
void fit_release(TaskId id, const RecordedGraph& graph, const std::vector<const tracing::Job*>& jobs,
                 Duration most, RecordedTimers& timers) {
  Timer polled = timer_of(id, graph, timers), released = polled;  // by the executor, by a separate thread
  bool early = false, early_released = false;
  Duration ahead{};
  for (const tracing::Job* job : jobs) {
    const Time release = released.next_call();
    early_released |= release - job->start > kCreationEvent;
    released.call(release == timers.first[id] ? timers.begin : release);
    const Duration before = polled.next_call() - job->start;
    early |= before > most;
    if (before > most) continue;
    ahead = std::max(ahead, before);
    polled.call(job->start);
  }
  timers.first[id] -= ahead;
  timers.released[id] = early && !early_released;
}

void refuse_jumps(const Task& task, Time first, std::size_t jobs, Time end) {
  const double span_ms = to_ms(end - first), releases = span_ms / to_ms(task.period);
  if (releases < std::max(kManyReleases, kReleasesPerJob * static_cast<double>(jobs))) return;
  throw program::UsageError(program::text(
      "the trace's clock jumps, or the trace is damaged: `%s`, of period %g ms, would have been "
      "due %.0f times in %.0f s, in which %zu callbacks ran; record it again, or cut it",
      task.name.c_str(), to_ms(task.period), releases, span_ms / 1e3, jobs));
}

/// The row of a job, without what its sample or timer tell.
JobRecord row_of(const tracing::System& system, const tracing::Job& job) {
  const auto process = system.processes.find(system.threads[job.thread].process);
  return {.start = job.start,
          .finish = job.ended ? job.finish : Time{},
          .outcome = job.ended ? Outcome::ran : Outcome::running,
          .worker = static_cast<std::uint16_t>(job.thread),
          .process = static_cast<std::uint16_t>(std::distance(system.processes.begin(), process)),
          .cpu = static_cast<std::int16_t>(job.processor)};
}

/// After this time a thread that shares a wait set sleeps, even if its wait began twice.
constexpr Duration kBeginning = std::chrono::microseconds(500);

/// A kind of job with fewer dispatches than this has the median of all dispatches.
constexpr std::size_t kEnough = 100;

/// Times before the starts of jobs, with the kind of each job.
using Gaps = std::vector<std::pair<TaskKind, Duration>>;

MeasuredCost cost_of(std::vector<Duration> samples) {
  if (samples.empty()) return {};
  std::ranges::sort(samples);
  const auto at = [&](std::size_t percent) { return samples[(samples.size() - 1) * percent / 100]; };
  const auto outliers = samples.end() - std::ranges::upper_bound(samples, 10 * at(50));
  return {samples.size(), static_cast<std::size_t>(outliers), at(0), at(50), at(90), at(99), at(100)};
}
MeasuredCost cost_of(const Gaps& gaps, std::optional<TaskKind> kind = {}) {
  std::vector<Duration> samples;
  for (const auto& [of, gap] : gaps)
    if (!kind || of == *kind) samples.push_back(gap);
  return cost_of(std::move(samples));
}

/// The gaps before the jobs of an executor.
struct ExecutorGaps {
  Gaps dispatch, wait, wake_up;
  std::vector<Duration> deliveries;
};

/// Whether a recorded callback published the job's sample, between processes or threads.
bool is_delivered(const Task& task, const tracing::Job& job) {
  return task.kind == TaskKind::subscription && task.entity == EntityKind::subscription &&
         job.sample.parent.callback != kNone;
}

ExecutorGaps gaps_of(const TaskSet& set, const RecordedWindow& window, const RecordedExecutor& executor,
                     const ExecutorTraits& traits) {
  const auto place = [&](TaskId id) {
    const int kind = place_of_kind(set[id], traits.runs_first.value_or(TaskKind::timer));
    return id + static_cast<std::size_t>(kind) * set.size();
  };
  const bool wait_set = traits.family == Family::wait_set, shares_waits = wait_set && traits.many_workers;
  const bool waits_recorded = std::ranges::any_of(
      window.jobs, [&](const tracing::Job& job) { return job.waited && executor.has(job.thread); });
  std::map<std::int32_t, Time> busy_until;        // by processor: end of its earlier jobs
  std::map<std::uint32_t, std::size_t> previous;  // by thread
  std::map<std::uint32_t, Time> group_until;      // by callback group: end of its earlier jobs
  ExecutorGaps gaps;
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const tracing::Job& job = window.jobs[i];
    const TaskId task = window.records[i].job.task;
    const Time ready = window.records[i].job.timestamp, busy = busy_until[job.processor];
    if (job.ended) busy_until[job.processor] = std::max(busy, job.finish);
    if (!job.ended || !executor.has(job.thread)) continue;
    const auto [before, is_first] = previous.try_emplace(job.thread, i);
    const std::size_t last = std::exchange(before->second, i);
    if (task == kNoTask) continue;
    Time& of_group = group_until[set[task].group];
    const Time group_free = std::exchange(of_group, std::max(of_group, job.finish));
    const Time free = window.jobs[last].finish;
    // Nested jobs, and jobs that waited for their callback group, which another thread served, do not count.
    if (is_first || job.start < free || group_free > std::max(ready, free)) continue;
    if (ready <= free) {
      const TaskId last_task = window.records[last].job.task;
      const bool new_round = last_task != kNoTask && place(task) <= place(last_task);
      const bool waited = wait_set && (waits_recorded ? job.waited : new_round);
      (waited ? gaps.wait : gaps.dispatch).emplace_back(set[task].kind, job.start - free);
    } else if (busy <= ready && !(shares_waits && ready < free + kBeginning)) {
      // Neither another job on the processor delayed it, nor did the beginning wait notice it.
      gaps.wake_up.emplace_back(set[task].kind, job.start - ready);
      const Time taken = job.decided > ready ? job.decided : job.start;
      if (is_delivered(set[task], job)) gaps.deliveries.push_back(taken - ready);
    }
  }
  return gaps;
}

/// A thread that preempts another one begins sooner; a time slice ends later.
constexpr Duration kPreempts = std::chrono::microseconds(500);
/// The most levels of relative priorities.
constexpr int kMostLevels = 9;

/// How often jobs of one thread met jobs of another thread on one processor. Few exceptions do not
/// count: threads of the ordinary policy also preempt each other, and take turns.
struct Meetings {
  std::uint32_t within = 0;  ///< Ran within a job of the other thread: preempted it.
  std::uint32_t waited = 0;  ///< Became ready during a job of the other thread and began after it.
  std::uint32_t sliced = 0;  ///< Became ready during a job of the other thread and began later during it.

  [[nodiscard]] bool takes_turns() const { return sliced > 3 && 10 * sliced > within; }
  [[nodiscard]] bool is_above(const Meetings& of_other) const {
    return within > 3 && within > 10 * of_other.within && !takes_turns();
  }
  [[nodiscard]] bool waits_for(const Meetings& of_other) const {
    return waited > 4 && waited > 20 * within && !of_other.takes_turns();
  }
};
using AllMeetings = std::vector<std::vector<Meetings>>;  // by both threads

/// Subtracts the jobs that preempted a job from its length.
AllMeetings meet(const RecordedWindow& window, std::size_t threads, std::vector<Duration>& own) {
  AllMeetings met(threads, std::vector<Meetings>(threads));
  std::map<std::int32_t, std::vector<std::size_t>> open;                // by processor
  std::map<std::int32_t, std::map<std::uint32_t, std::size_t>> latest;  // by processor and thread
  std::vector<Time> idle_since(threads, Time::min());
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const tracing::Job& job = window.jobs[i];
    if (!job.ended) continue;
    own[i] = job.finish - job.start;
    std::vector<std::size_t>& others = open[job.processor];
    std::erase_if(others, [&](std::size_t o) { return window.jobs[o].finish <= job.start; });
    const auto surrounds = [&](std::size_t o) {
      return window.jobs[o].thread != job.thread && window.jobs[o].finish >= job.finish;
    };
    const auto innermost = std::find_if(others.rbegin(), others.rend(), surrounds);  // it had the processor
    if (innermost != others.rend()) {
      own[*innermost] -= own[i];
      ++met[job.thread][window.jobs[*innermost].thread].within;
    }
    others.push_back(i);
    const Time ready = window.records[i].job.timestamp;
    const bool was_idle = window.records[i].job.task != kNoTask && idle_since[job.thread] < ready;
    for (const auto& [thread, last] : latest[job.processor]) {
      const tracing::Job& before = window.jobs[last];
      if (!was_idle || thread == job.thread || before.start >= ready || ready >= before.finish) continue;
      met[job.thread][thread].waited += before.finish <= job.start;
      met[job.thread][thread].sliced += before.finish > job.start && job.start > ready + kPreempts;
    }
    latest[job.processor][job.thread] = i;
    idle_since[job.thread] = std::max(idle_since[job.thread], job.finish);
  }
  return met;
}

}  // namespace

RecordedTimers recorded_timers(const tracing::System& system, const RecordedGraph& graph,
                               std::span<const tracing::Job> jobs, Time end) {
  const TaskId count = graph.tasks.set.size();
  RecordedTimers timers{std::vector<Time>(count), {}, std::vector<bool>(count, false)};
  std::vector<std::vector<const tracing::Job*>> jobs_of(count);
  bool begun = false;
  for (const tracing::Job& job : jobs) {
    if (graph.task(job.ref) == kNoTask) continue;
    if (!std::exchange(begun, true)) timers.begin = job.start;
    jobs_of[graph.task(job.ref)].push_back(&job);
  }
  const std::vector<TaskId> recorded = timers_of(graph);
  for (const TaskId id : recorded)
    timers.first[id] = first_release(system.callbacks[graph.callback_of[id]], jobs_of[id]);
  const std::vector<Duration> most = most_ahead(graph, timers, jobs);
  for (const TaskId id : recorded) fit_release(id, graph, jobs_of[id], most[id], timers);
  for (const TaskId id : recorded) refuse_jumps(graph.tasks.set[id], timers.first[id], jobs.size(), end);
  return timers;
}

RecordedRows recorded_rows(const RecordedSystem& recorded, const RecordedGraph& graph,
                           const RecordedTimers& first, const std::vector<bool>& release_only) {
  const TaskSet& set = graph.tasks.set;
  std::vector<Timer> timers;  // by task
  timers.reserve(set.size());
  for (TaskId id = 0; id < set.size(); ++id) timers.push_back(timer_of(id, graph, first));
  // By task, by number: of the latest jobs.
  std::vector<std::vector<std::uint64_t>> sequences(set.size(), std::vector<std::uint64_t>(kRemembered));
  const auto of_timer = [&](TaskId task, const tracing::Job& job) {
    const Time next = timers[task].next_call(), due = next == first.first[task] ? first.begin : next;
    Job called = timers[task].call(release_only[task] ? due : job.start);
    called.timestamp = std::min(next, job.start);
    called.deadline = called.timestamp + set[task].deadline;
    called.release = release_only[task] ? called.timestamp : job.start;
    if (job.release > Time{}) called.release = std::clamp(job.release, called.timestamp, job.start);
    return called;
  };
  const auto of_sample = [&](TaskId task, const tracing::Sample& sample) {
    Job job{task, sample.sequence, sample.published, sample.published, kNever, {}};
    const TaskId parent = graph.task(sample.parent);
    if (parent != kNoTask) job.parent = {parent, sequences[parent][sample.parent.number % kRemembered]};
    return job;
  };
  RecordedRows rows;
  rows.jobs.reserve(recorded.jobs.size());
  for (const tracing::Job& job : recorded.jobs) {
    JobRecord& r = rows.jobs.emplace_back();
    const TaskId task = graph.task(job.ref);
    if (task == kNoTask) continue;
    r = row_of(recorded.system, job);
    r.job = set[task].kind == TaskKind::timer ? of_timer(task, job) : of_sample(task, job.sample);
    sequences[task][job.ref.number % kRemembered] = r.job.sequence;
  }
  for (const tracing::LostSample& lost : recorded.lost)
    if (const TaskId task = graph.task_of[lost.subscription]; task != kNoTask)
      rows.others.push_back({.job = of_sample(task, lost.sample),
                             .outcome = lost.queued ? Outcome::queued : Outcome::overwritten});
  for (const TaskId id : timers_of(graph)) {
    while (timers[id].next_call() < recorded.end) {
      Job job = timers[id].call(release_only[id] ? timers[id].next_call() : recorded.end - Duration(1));
      job.release = job.timestamp;
      rows.others.push_back({.job = job, .outcome = Outcome::queued});
    }
  }
  return rows;
}

MeasuredCost RecordedCosts::dispatch_of(TaskKind kind) const {
  const MeasuredCost& own = kind == TaskKind::timer ? timer_dispatch : subscription_dispatch;
  return own.n < kEnough ? dispatch : own;
}

RecordedCosts recorded_costs(const RecordedGraph& graph, const RecordedWindow& window,
                             const RecordedExecutor& executor, const ExecutorTraits& traits,
                             const MeasuredCost& elsewhere) {
  ExecutorGaps gaps = gaps_of(graph.tasks.set, window, executor, traits);
  RecordedCosts costs;
  costs.dispatch = cost_of(gaps.dispatch);
  costs.timer_dispatch = cost_of(gaps.dispatch, TaskKind::timer);
  costs.subscription_dispatch = cost_of(gaps.dispatch, TaskKind::subscription);
  const auto without_dispatch = [&](auto& kind_and_gap) {
    const MeasuredCost own = costs.dispatch_of(kind_and_gap.first);
    const Duration dispatch = (own.n == 0 ? elsewhere : own).median;
    kind_and_gap.second = std::max(Duration::zero(), kind_and_gap.second - dispatch);
  };
  std::ranges::for_each(gaps.wait, without_dispatch);
  std::ranges::for_each(gaps.wake_up, without_dispatch);
  // A timer's releaser wakes the thread that runs its job.
  const bool two_wake_ups =
      traits.timers == TimerHandling::release_only || traits.timers == TimerHandling::marked_ready;
  for (auto& [kind, late] : gaps.wake_up)
    if (kind == TaskKind::timer && two_wake_ups) late /= 2;
  costs.wait = cost_of(gaps.wait);
  costs.wake_up = cost_of(gaps.wake_up);
  costs.deliveries = std::move(gaps.deliveries);
  return costs;
}

MeasuredCost measured_delivery(std::span<const RecordedCosts> costs) {
  std::vector<Duration> all;
  for (const RecordedCosts& of : costs) all.insert(all.end(), of.deliveries.begin(), of.deliveries.end());
  return cost_of(std::move(all));
}

Displacement recorded_displacement(const tracing::System& system, const RecordedWindow& window) {
  const std::size_t threads = system.threads.size();
  Displacement displacement{std::vector<Duration>(window.jobs.size()), std::vector<int>(threads, 0), {}, {}};
  for (const tracing::Thread& thread : system.threads)
    displacement.processors.push_back(usual_processors(thread));
  const AllMeetings met = meet(window, threads, displacement.own);
  for (std::size_t round = 0; round < threads; ++round) {
    for (std::size_t a = 0; a < threads; ++a) {
      for (std::size_t b = 0; b < threads; ++b) {
        int& level = displacement.level[a];
        if (met[a][b].is_above(met[b][a]))
          level = std::max(level, std::min(displacement.level[b] + 1, kMostLevels));
        if (met[b][a].waits_for(met[a][b])) level = std::max({level, displacement.level[b], 1});
      }
    }
  }
  follow_time_slices(system, window, displacement);
  return displacement;
}

}  // namespace hotpath::imports
