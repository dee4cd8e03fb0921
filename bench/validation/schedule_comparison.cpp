// SPDX-License-Identifier: Apache-2.0
#include "validation/schedule_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hotpath/core/job_order.hpp"

namespace hotpath {

namespace {

/// Jobs whose order is compared: the time for it grows with their square.
constexpr std::size_t kMostCompared = 10000;

void sort_by_start(std::vector<ExecutedJob>& jobs) {
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const ExecutedJob& a, const ExecutedJob& b) { return a.start < b.start; });
}

JobOrder sequence(const Schedule& schedule, Time until) {
  JobOrder tasks;
  for (const ExecutedJob& job : schedule.jobs) {
    if (job.start <= until) tasks.push_back(job.task);
  }
  return tasks;
}

double lost_percent(const JobOrder& tasks, const Task& task, TaskId id, Time until) {
  if (until < Time{} + task.phase) return 0;
  const auto timestamps = 1 + (until - Time{} - task.phase) / task.period;
  const auto executed = std::count(tasks.begin(), tasks.end(), id);
  return 100 * std::max(0.0, 1 - static_cast<double>(executed) / static_cast<double>(timestamps));
}

void measure(const Schedule& schedule, Time until, Quantiles& lateness, Quantiles& response,
             Quantiles& authors) {
  std::vector<double> late, responses, as_authors;
  for (const ExecutedJob& job : schedule.jobs) {
    if (job.start > until || !job.finished()) continue;
    late.push_back(to_ms(job.start - job.timestamp));
    responses.push_back(to_ms(job.finish - job.timestamp));
    if (job.next_call != kNever) as_authors.push_back(to_ms(response_authors(schedule, job)));
  }
  lateness = quantiles(std::move(late));
  response = quantiles(std::move(responses));
  authors = quantiles(std::move(as_authors));
}

}  // namespace

Schedule schedule_of(const TaskSet& set, const Trace& trace) {
  Schedule schedule{set, {}};
  std::vector<std::vector<const JobRecord*>> released(set.size());
  for (const JobRecord& r : trace.jobs) {
    const bool counts =
        r.outcome == Outcome::ran || r.outcome == Outcome::running || r.outcome == Outcome::queued;
    if (counts && set[r.job.task].kind == TaskKind::timer) released[r.job.task].push_back(&r);
  }
  for (auto& of_timer : released) {
    std::stable_sort(of_timer.begin(), of_timer.end(),
                     [](const JobRecord* a, const JobRecord* b) { return a->job.release < b->job.release; });
  }
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran && r.outcome != Outcome::running) continue;
    ExecutedJob job;
    job.task = r.job.task;
    job.timestamp = Time{} + (r.job.timestamp - trace.epoch);
    job.start = Time{} + (r.start - trace.epoch);
    if (r.outcome == Outcome::ran) job.finish = Time{} + (r.finish - trace.epoch);
    const auto& of_timer = released[r.job.task];
    const auto later = std::upper_bound(of_timer.begin(), of_timer.end(), r.start,
                                        [](Time t, const JobRecord* o) { return t < o->job.release; });
    if (later != of_timer.begin()) {
      const Job& latest = (*std::prev(later))->job;
      job.next_call =
          Time{} + (latest.timestamp - trace.epoch) + (1 + latest.skipped) * set[r.job.task].period;
    }
    schedule.jobs.push_back(job);
  }
  sort_by_start(schedule.jobs);
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

double ScheduleComparison::largest_loss_difference() const {
  double largest = 0;
  for (const TaskComparison& t : tasks) {
    largest = std::max(largest, std::abs(t.lost_percent[0] - t.lost_percent[1]));
  }
  return largest;
}

ScheduleComparison compare(const Schedule& measured, const Schedule& predicted) {
  ScheduleComparison c;
  if (measured.jobs.empty() || predicted.jobs.empty()) return c;
  const Time until =
      std::min(measured.jobs.back().start, predicted.jobs.back().start) + std::chrono::milliseconds(1);
  JobOrder a = sequence(measured, until), b = sequence(predicted, until);
  c.jobs[0] = a.size();
  c.jobs[1] = b.size();
  const auto [in_a, in_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  if (in_a != a.end() && in_b != b.end()) {
    const auto place = static_cast<std::size_t>(in_a - a.begin());
    c.first_difference = {
        place, measured.jobs[place].start, {measured.set[*in_a].name, measured.set[*in_b].name}};
  }
  for (TaskId id = 0; id < measured.set.size(); ++id) {
    const Task& task = measured.set[id];
    if (task.kind != TaskKind::timer) continue;
    c.tasks.push_back({task.name, {lost_percent(a, task, id, until), lost_percent(b, task, id, until)}});
  }
  a.resize(std::min(a.size(), kMostCompared));
  b.resize(std::min(b.size(), kMostCompared));
  c.similarity = similarity(a, b);
  c.similarity_by_period = similarity(by_period(a, measured.set), by_period(b, measured.set));
  measure(measured, until, c.lateness_ms[0], c.response_ms[0], c.response_authors_ms[0]);
  measure(predicted, until, c.lateness_ms[1], c.response_ms[1], c.response_authors_ms[1]);
  return c;
}

}  // namespace hotpath
