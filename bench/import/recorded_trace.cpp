// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_window.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

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
  JobRecord r;
  r.start = job.start;
  r.finish = job.ended ? job.finish : Time{};
  r.outcome = job.ended ? Outcome::ran : Outcome::running;
  r.worker = static_cast<std::uint16_t>(job.thread);
  const auto process = system.processes.find(system.threads[job.thread].process);
  r.process = static_cast<std::uint16_t>(std::distance(system.processes.begin(), process));
  r.cpu = static_cast<std::int16_t>(job.processor);
  return r;
}

}  // namespace

RecordedTimers recorded_timers(const tracing::System& system, const RecordedGraph& graph,
                               std::span<const tracing::Job> jobs, Time end) {
  const TaskId count = graph.tasks.set.size();
  RecordedTimers timers{std::vector<Time>(count), {}, std::vector<bool>(count, false)};
  std::vector<std::vector<const tracing::Job*>> jobs_of(count);
  const auto in_graph = [&](const tracing::Job& job) { return graph.task(job.ref) != kNoTask; };
  if (const auto first = std::ranges::find_if(jobs, in_graph); first != jobs.end())
    timers.begin = first->start;
  for (const tracing::Job& job : jobs)
    if (in_graph(job)) jobs_of[graph.task(job.ref)].push_back(&job);
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
  const auto add = [&](Outcome outcome, const Job& job) {
    JobRecord& r = rows.others.emplace_back();
    r.job = job;
    r.outcome = outcome;
  };
  for (const tracing::LostSample& lost : recorded.lost)
    if (const TaskId task = graph.task_of[lost.subscription]; task != kNoTask)
      add(lost.queued ? Outcome::queued : Outcome::overwritten, of_sample(task, lost.sample));
  for (const TaskId id : timers_of(graph)) {
    while (timers[id].next_call() < recorded.end) {
      Job job = timers[id].call(release_only[id] ? timers[id].next_call() : recorded.end - Duration(1));
      job.release = job.timestamp;
      add(Outcome::queued, job);
    }
  }
  return rows;
}

}  // namespace hotpath::imports
