// SPDX-License-Identifier: Apache-2.0
#include "results/schedule.hpp"

#include <algorithm>
#include <utility>

namespace hotpath::results {

namespace {

/// For each timer: its released jobs, by release.
std::vector<std::vector<const Job*>> releases(const TaskSet& set, const Trace& trace) {
  std::vector<std::vector<const Job*>> released(set.size());
  for (const JobRecord& r : trace.jobs) {
    const bool counts = started(r) || r.outcome == Outcome::queued;
    if (counts && set[r.job.task].kind == TaskKind::timer) released[r.job.task].push_back(&r.job);
  }
  for (auto& of_timer : released) {
    std::ranges::stable_sort(of_timer, {}, &Job::release);
  }
  return released;
}

}  // namespace

Schedule schedule_of(const TaskSet& set, const Trace& trace) {
  Schedule schedule{set, {}};
  const auto since_epoch = [&](Time t) { return Time{} + (t - trace.epoch); };
  const auto released = releases(set, trace);
  for (const JobRecord& r : trace.jobs) {
    if (!started(r)) continue;
    ExecutedJob& job = schedule.jobs.emplace_back();
    job.task = r.job.task;
    job.timestamp = since_epoch(r.job.timestamp);
    job.start = since_epoch(r.start);
    if (r.outcome == Outcome::ran) job.finish = since_epoch(r.finish);
    const auto& of_timer = released[r.job.task];
    const auto later = std::ranges::upper_bound(of_timer, r.start, {}, &Job::release);
    if (later == of_timer.begin()) continue;
    const Job& latest = **std::prev(later);
    job.next_call = since_epoch(latest.timestamp) + (1 + latest.skipped) * set[r.job.task].period;
  }
  std::ranges::stable_sort(schedule.jobs, {}, &ExecutedJob::start);
  return schedule;
}

Schedule schedule_of(const GoldenTrace& trace, bool release_only) {
  Schedule schedule{trace.set, {}};
  std::vector<Time> next_call;
  for (const Task& task : trace.set.tasks) next_call.push_back(Time{} + task.phase);
  for (const GoldenJob& job : trace.jobs) {
    const Task& task = trace.set[job.task];
    const Time called = std::exchange(next_call[job.task], job.next_call);
    const Time of_its_number = Time{} + task.phase + static_cast<std::int64_t>(job.count) * task.period;
    schedule.jobs.push_back(
        {job.task, release_only ? of_its_number : called, job.start, job.finish, job.next_call});
  }
  return schedule;
}

Duration response_authors(const Schedule& schedule, const ExecutedJob& job) {
  return job.finish - (job.next_call - schedule.set[job.task].period);
}

}  // namespace hotpath::results
