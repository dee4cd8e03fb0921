// SPDX-License-Identifier: Apache-2.0
#include "nasri_2017.hpp"

#include <limits>
#include <set>
#include <tuple>

#include "task_sets.hpp"

namespace hotpath {

namespace {

constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::max();

/// Finished jobs, and the interval in which the processor becomes available.
struct State {
  std::size_t front = 0;         // all jobs before this one are finished,
  std::set<std::size_t> beyond;  // and these: few, since schedules follow the releases
  std::int64_t earliest = 0, latest = 0;
};

/// Section IV of Nasri and Brandenburg: adds the states after each job that can start next.
void expand(const std::vector<SagJob>& jobs, const State& s, std::vector<State>& next,
            std::vector<SagFinish>& finish) {
  std::int64_t certain = kNoTime;  // the processor idles at most until some job has certainly arrived
  std::set<std::tuple<std::int64_t, std::size_t, std::size_t>> candidates;  // by priority
  for (std::size_t i = s.front; i < jobs.size(); ++i) {
    if (jobs[i].arrival_min > std::max(s.latest, certain)) break;
    if (s.beyond.count(i) > 0) continue;
    certain = std::min(certain, jobs[i].arrival_max);
    candidates.insert({jobs[i].priority, jobs[i].task, i});
  }
  const std::int64_t latest_idle = std::max(s.latest, certain);
  std::int64_t higher_arrived = kNoTime;  // when some higher-priority job has certainly arrived
  for (const auto& candidate : candidates) {
    const std::size_t i = std::get<2>(candidate);
    const std::int64_t earliest_start = std::max(s.earliest, jobs[i].arrival_min);
    const std::int64_t latest_start =
        std::min(latest_idle, higher_arrived == kNoTime ? kNoTime : higher_arrived - 1);
    higher_arrived = std::min(higher_arrived, jobs[i].arrival_max);
    if (earliest_start > latest_start) continue;
    State after{s.front, s.beyond, earliest_start + jobs[i].cost_min, latest_start + jobs[i].cost_max};
    after.beyond.insert(i);
    while (after.beyond.erase(after.front) > 0) ++after.front;
    finish[i].earliest = std::min(finish[i].earliest, after.earliest);
    finish[i].latest = std::max(finish[i].latest, after.latest);
    next.push_back(std::move(after));
  }
}

/// Merges states with the same finished jobs and intersecting intervals.
std::vector<State> merged(std::vector<State> states) {
  std::sort(states.begin(), states.end(), [](const State& a, const State& b) {
    return std::tie(a.front, a.beyond, a.earliest) < std::tie(b.front, b.beyond, b.earliest);
  });
  std::vector<State> kept;
  for (State& s : states) {
    if (!kept.empty() && kept.back().latest >= s.earliest && kept.back().front == s.front &&
        kept.back().beyond == s.beyond) {
      kept.back().latest = std::max(kept.back().latest, s.latest);
    } else {
      kept.push_back(std::move(s));
    }
  }
  return kept;
}

/// The largest age of unfinished jobs at a release: the longest busy window plus the largest
/// jitter. 0 without jitter, because then everything repeats with the hyperperiod.
std::int64_t busy_window_with_jitter(const PeriodicTasks& tasks) {
  std::int64_t largest = 0;
  for (const PeriodicTask& t : tasks) largest = std::max(largest, t.jitter);
  if (largest == 0) return 0;
  for (std::int64_t window = 1;;) {
    std::int64_t work = 0;
    for (const PeriodicTask& t : tasks) work += exact::ceil_div(window + t.jitter, t.period) * t.wcet;
    if (work <= window) return largest + window;
    window = work;
  }
}

std::vector<SagJob> sag_jobs(const PeriodicTasks& tasks, Policy policy) {
  const std::int64_t h = hyperperiod(tasks);
  std::int64_t latest_phase = 0;
  for (const PeriodicTask& t : tasks) latest_phase = std::max(latest_phase, t.phase);
  const std::int64_t horizon =
      (latest_phase > 0 ? latest_phase + 2 * h : h) + exact::ceil_div(busy_window_with_jitter(tasks), h) * h;
  std::vector<SagJob> jobs;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const PeriodicTask& t = tasks[i];
    for (std::int64_t r = t.phase; r < horizon; r += t.period) {
      jobs.push_back({.task = i,
                      .arrival_min = r,
                      .arrival_max = r + t.jitter,
                      .cost_min = t.bcet,
                      .cost_max = t.wcet,
                      .priority = policy == Policy::edf ? r + t.deadline : static_cast<std::int64_t>(i)});
    }
  }
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const SagJob& a, const SagJob& b) { return a.arrival_min < b.arrival_min; });
  return jobs;
}

}  // namespace

std::vector<SagFinish> nasri_2017(const std::vector<SagJob>& jobs) {
  std::vector<SagFinish> finish(jobs.size(), {kNoTime, 0});
  std::vector<State> level(1);
  for (std::size_t depth = 0; depth < jobs.size(); ++depth) {
    std::vector<State> next;
    for (const State& s : level) expand(jobs, s, next, finish);
    level = merged(std::move(next));
  }
  return finish;
}

ResponseTimes sag_response_times(const PeriodicTasks& tasks, Policy policy) {
  const std::vector<SagJob> jobs = sag_jobs(tasks, policy);
  const std::vector<SagFinish> finish = nasri_2017(jobs);
  ResponseTimes largest(tasks.size(), 0);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    std::optional<std::int64_t>& response = largest[jobs[i].task];
    response = std::max(*response, finish[i].latest - jobs[i].arrival_min);
  }
  return largest;
}

}  // namespace hotpath
