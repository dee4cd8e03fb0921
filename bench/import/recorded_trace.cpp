// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_window.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Most time from rcl's clock reading to the event of a timer's creation.
constexpr Duration kCreationEvent = std::chrono::milliseconds(1);

/// A thread that ran nothing for so long was idle. No event comes later by waking up alone.
constexpr Duration kIdle = std::chrono::microseconds(200);

/// With more releases, and more per job, the trace's clock must have jumped.
constexpr double kManyReleases = 1e6, kReleasesPerJob = 1e3;

/// The instant nearest to `about` that whole periods separate from `due`.
Time on_grid(Time about, Time due, Duration period) {
  const auto apart = static_cast<double>((due - about).count()) / static_cast<double>(period.count());
  return due - std::llround(apart) * period;
}

/// The timers of the system, without those of the node `outside`.
std::vector<TaskId> timers_of(const RecordedGraph& graph) {
  std::vector<TaskId> timers;
  for (TaskId id = 0; id < graph.tasks.set.size(); ++id)
    if (graph.tasks.set[id].kind == TaskKind::timer && graph.callback_of[id] != kNone) timers.push_back(id);
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
    if (id == kNoTask || graph.tasks.set[id].kind != TaskKind::timer || job.start - since < kIdle) continue;
    const Duration period = graph.tasks.set[id].period;
    const Duration ahead = (period + (timers.first[id] - job.start) % period) % period;
    most[id] = std::max(most[id], kIdle + (ahead > kCreationEvent ? Duration::zero() : ahead));
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

RecordedTrace::RecordedTrace(const tracing::System& system, const RecordedGraph& graph,
                             const RecordedTimers& timers, std::vector<bool> release_only)
    : system_(system),
      graph_(graph),
      release_only_(std::move(release_only)),
      recorded_timers_(timers),
      sequences_(graph.tasks.set.size()) {
  for (TaskId id = 0; id < timers.first.size(); ++id) timers_.push_back(timer_of(id, graph, timers));
  for (auto& of_task : sequences_) of_task.resize(kRemembered);
}

JobRecord RecordedTrace::job(const tracing::Job& job) {
  const TaskId task = graph_.task(job.ref);
  JobRecord r;
  if (graph_.tasks.set[task].kind == TaskKind::timer) {
    r.job = timer_job(task, job.start);
    if (job.release > Time{}) r.job.release = std::clamp(job.release, r.job.timestamp, job.start);
  } else {
    r.job = subscription_job(task, job.sample);
  }
  sequences_[task][job.ref.number % kRemembered] = r.job.sequence;
  r.start = job.start;
  r.finish = job.ended ? job.finish : Time{};
  r.outcome = job.ended ? Outcome::ran : Outcome::running;
  r.worker = static_cast<std::uint16_t>(job.thread);
  const std::uint32_t process = system_.threads[job.thread].process;
  r.process =
      static_cast<std::uint16_t>(std::distance(system_.processes.begin(), system_.processes.find(process)));
  r.cpu = static_cast<std::int16_t>(job.processor);
  return r;
}

std::vector<JobRecord> RecordedTrace::jobs(std::span<const tracing::Job> jobs) {
  std::vector<JobRecord> rows;
  for (const tracing::Job& job : jobs)
    rows.push_back(graph_.task(job.ref) != kNoTask ? this->job(job) : JobRecord{});
  return rows;
}

Job RecordedTrace::timer_job(TaskId task, Time start) {
  Timer& timer = timers_[task];
  const Time next = timer.next_call();
  const Time released = next == recorded_timers_.first[task] ? recorded_timers_.begin : next;
  Job job = timer.call(release_only_[task] ? released : start);
  job.timestamp = std::min(next, start);
  job.deadline = job.timestamp + graph_.tasks.set[task].deadline;
  job.release = release_only_[task] ? job.timestamp : start;
  return job;
}

JobRecord RecordedTrace::lost(const tracing::LostSample& lost) const {
  JobRecord r;
  r.job = subscription_job(graph_.task_of[lost.subscription], lost.sample);
  r.outcome = lost.queued ? Outcome::queued : Outcome::overwritten;
  return r;
}

std::vector<JobRecord> RecordedTrace::due(Time end) const {
  std::vector<JobRecord> due;
  for (const TaskId id : timers_of(graph_)) {
    for (Timer timer = timers_[id]; timer.next_call() < end;) {
      JobRecord& r = due.emplace_back();
      r.outcome = Outcome::queued;
      r.job = timer.call(release_only_[id] ? timer.next_call() : end - Duration(1));
      r.job.release = r.job.timestamp;
    }
  }
  return due;
}

Job RecordedTrace::subscription_job(TaskId task, const tracing::Sample& sample) const {
  Job job;
  job.task = task;
  job.sequence = sample.sequence;
  job.timestamp = job.release = sample.published;
  const TaskId parent = graph_.task(sample.parent);
  if (parent != kNoTask) job.parent = {parent, sequences_[parent][sample.parent.number % kRemembered]};
  return job;
}

}  // namespace hotpath::imports
