// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_trace.hpp"

#include <algorithm>

#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

/// Most time from rcl's clock reading to the event of a timer's creation.
constexpr Duration kCreationEvent = std::chrono::milliseconds(1);

/// With more releases, and more per job, the trace's clock must have jumped.
constexpr double kManyReleases = 1e6, kReleasesPerJob = 1e3;

/// A call at `start` moves `next` beyond `start`. Returns the number of skipped timestamps.
std::uint32_t step(Time& next, Time start, Duration period) {
  next += period;
  if (next > start) return 0;
  const auto skipped = static_cast<std::uint32_t>((start - next) / period + 1);
  next += skipped * period;
  return skipped;
}

void refuse_jumps(const RecordedTimers& timers, const RecordedGraph& graph, std::size_t jobs, Time end) {
  for (TaskId id = 0; id < timers.first.size(); ++id) {
    const Task& task = graph.tasks.set[id];
    if (task.kind != TaskKind::timer || graph.callback_of[id] == kNone) continue;
    const double span_ms = to_ms(end - timers.first[id]), releases = span_ms / to_ms(task.period);
    if (releases < std::max(kManyReleases, kReleasesPerJob * static_cast<double>(jobs))) continue;
    throw UsageError(
        text("the trace's clock jumps, or the trace is damaged: `%s`, of period %g ms, would have been "
             "due %.0f times in %.0f s, in which %zu callbacks ran; record it again, or cut it",
             task.name.c_str(), to_ms(task.period), releases, span_ms / 1e3, jobs));
  }
}

}  // namespace

RecordedTimers recorded_timers(const tracing::System& system, const RecordedGraph& graph,
                               std::span<const tracing::Job> jobs, Time end) {
  const TaskId count = graph.tasks.set.size();
  RecordedTimers timers{std::vector<Time>(count), {}, std::vector<bool>(count, false)};
  const auto first =
      std::ranges::find_if(jobs, [&](const tracing::Job& j) { return graph.task(j.ref) != kNoTask; });
  if (first != jobs.end()) timers.begin = first->start;
  // Next timestamp if the timer is polled, and if a separate thread releases its jobs.
  std::vector<Time> next(count), released(count);
  std::vector<bool> early(count, false), early_released(count, false);
  std::vector<Duration> ahead(count);
  for (TaskId id = 0; id < count; ++id) {
    const std::uint32_t c = graph.callback_of[id];
    if (graph.tasks.set[id].kind != TaskKind::timer || c == kNone) continue;
    timers.first[id] = next[id] = released[id] = system.callbacks[c].created + system.callbacks[c].period;
  }
  for (const tracing::Job& job : jobs) {
    const TaskId id = graph.task(job.ref);
    if (id == kNoTask || graph.tasks.set[id].kind != TaskKind::timer) continue;
    if (released[id] - job.start > kCreationEvent) early_released[id] = true;
    const bool first_job = released[id] == timers.first[id];
    step(released[id], first_job ? timers.begin : released[id], graph.tasks.set[id].period);
    const Duration before = next[id] - job.start;
    if (before > kCreationEvent) {
      early[id] = true;
      continue;
    }
    ahead[id] = std::max(ahead[id], before);
    step(next[id], job.start, graph.tasks.set[id].period);
  }
  for (TaskId id = 0; id < count; ++id) {
    timers.first[id] -= ahead[id];
    timers.released[id] = early[id] && !early_released[id];
  }
  refuse_jumps(timers, graph, jobs.size(), end);
  return timers;
}

RecordedTrace::RecordedTrace(const tracing::System& system, const RecordedGraph& graph,
                             const RecordedTimers& timers, std::vector<bool> release_only)
    : system_(system),
      graph_(graph),
      release_only_(std::move(release_only)),
      begin_(timers.begin),
      sequences_(graph.tasks.set.size()) {
  for (const Time first : timers.first) timers_.push_back({first, 0});
  for (auto& of_task : sequences_) of_task.resize(kRemembered);
}

JobRecord RecordedTrace::job(const tracing::Job& job) {
  const TaskId task = graph_.task(job.ref);
  JobRecord r;
  if (graph_.tasks.set[task].kind == TaskKind::timer) {
    r.job = timer_job(task, job.start);
  } else {
    r.job.task = task;
    r.job.sequence = job.sample.sequence;
    r.job.timestamp = r.job.release = job.sample.published;
    r.job.parent = parent_of(job.sample.parent);
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

Job RecordedTrace::timer_job(TaskId task, Time start) {
  TimerState& timer = timers_[task];
  const Task& of = graph_.tasks.set[task];
  Job job;
  job.task = task;
  job.sequence = timer.sequence;
  job.timestamp = std::min(timer.next, start);
  job.deadline = job.timestamp + of.deadline;
  if (release_only_[task]) {
    job.release = job.timestamp;
    job.skipped = step(timer.next, timer.sequence == 0 ? begin_ : timer.next, of.period);
  } else {
    job.release = start;
    job.skipped = step(timer.next, start, of.period);
  }
  timer.sequence += 1 + job.skipped;
  return job;
}

JobRecord RecordedTrace::lost(const tracing::LostSample& lost) const {
  JobRecord r;
  r.job.task = graph_.task_of[lost.subscription];
  r.job.sequence = lost.sample.sequence;
  r.job.timestamp = r.job.release = lost.sample.published;
  r.job.parent = parent_of(lost.sample.parent);
  r.outcome = lost.queued ? Outcome::queued : Outcome::overwritten;
  return r;
}

std::vector<JobRecord> RecordedTrace::due(Time end) const {
  std::vector<JobRecord> due;
  for (TaskId id = 0; id < timers_.size(); ++id) {
    const Task& task = graph_.tasks.set[id];
    if (task.kind != TaskKind::timer || graph_.callback_of[id] == kNone) continue;
    TimerState timer = timers_[id];
    while (timer.next < end) {
      JobRecord& r = due.emplace_back();
      r.outcome = Outcome::queued;
      r.job.task = id;
      r.job.sequence = timer.sequence++;
      r.job.timestamp = r.job.release = timer.next;
      r.job.deadline = timer.next + task.deadline;
      if (release_only_[id]) {
        timer.next += task.period;
      } else {
        r.job.skipped = step(timer.next, end - Duration(1), task.period);
      }
    }
  }
  return due;
}

JobRef RecordedTrace::parent_of(const tracing::JobRef& ref) const {
  const TaskId task = graph_.task(ref);
  if (task == kNoTask) return {};
  return {task, sequences_[task][ref.number % kRemembered]};
}

}  // namespace hotpath
