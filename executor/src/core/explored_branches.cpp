// SPDX-License-Identifier: Apache-2.0
#include "explored_branches.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace hotpath {

Time ExploredBranches::next_of_others(ExploredState& state) {
  SimulatedWorkers& workers = state.simulation->workers();
  std::vector<SimulatedWorkers::State> all;
  for (Worker w = 0; w < workers.size(); ++w) all.push_back(workers[w]);
  if (state.runs()) workers[ExploredState::kExecutor].until = kNever;
  if (state.runs()) workers[ExploredState::kExecutor].slice_end = kNever;
  if (state.releases) workers[ExploredState::kTimerThread].until = kNever;
  if (state.releases) workers[ExploredState::kTimerThread].slice_end = kNever;
  if (state.wakes) workers.sleep_until(ExploredState::kExecutor, kNever);
  if (state.timers_wake()) workers.sleep_until(ExploredState::kTimerThread, kNever);
  const Time next = state.simulation->next_of_threads();
  for (Worker w = 0; w < workers.size(); ++w) {
    if (all[w].step == ExploredState::Step::asleep) workers.sleep_until(w, all[w].until);
    workers[w].until = all[w].until;
    workers[w].slice_end = all[w].slice_end;
  }
  return next;
}

bool ExploredBranches::slice_matters(const ExploredState& state) const {
  if (!slices) return false;
  const SimulatedWorkers::State& timers = state.simulation->workers()[ExploredState::kTimerThread];
  return !timers.on_core && timers.step != ExploredState::Step::asleep &&
         timers.step != ExploredState::Step::blocked;
}

std::vector<ExploredBranches::Instant> ExploredBranches::ends_of_threads(const ExploredState& state) const {
  std::vector<Instant> ends;
  if (state.runs() || state.wakes) ends.push_back({kEnd, 0});
  if (state.runs() && slice_matters(state)) ends.push_back({kSlice, 0});
  if (state.releases) ends.push_back({kTimers, 0});
  return ends;
}

void ExploredBranches::move_to(const std::vector<std::int64_t>& point, ExploredState& state) const {
  SimulatedWorkers& workers = state.simulation->workers();
  SimulatedWorkers::State& executor = state.executor();
  const auto instant = [&](std::size_t coordinate) { return Time{} + Duration(point[coordinate]); };
  if (state.runs()) {
    executor.until = executor.step_end = instant(kEnd);
    state.end_there = point[kEnd];
    if (slices) executor.slice_end = instant(kSlice);
  }
  if (state.wakes) workers.sleep_until(ExploredState::kExecutor, instant(kEnd));
  if (state.timers_wake()) {
    workers.sleep_until(ExploredState::kTimerThread, instant(kTimers));
  } else if (state.releases) {
    SimulatedWorkers::State& timers = workers[ExploredState::kTimerThread];
    const Duration slice = timers.slice_end - timers.until;
    timers.until = timers.step_end = instant(kTimers);
    timers.slice_end = timers.until + slice;
    if (state.busy() && !executor.on_core) {  // displaced since the release began
      executor.until = executor.step_end = instant(kEnd);
      executor.remaining = executor.until - (timers.until - timers.remaining);
      state.end_there = point[kEnd];
    }
  }
  state.simulation->reschedule_arrivals([&](JobRef job) {
    const Instant arrival = arrival_from(state, job);
    return instant(arrival.coordinate) + Duration(arrival.later);
  });
}

std::vector<ExploredBranches::Instant> ExploredBranches::arrivals(const ExploredState& state) const {
  std::vector<Instant> all;
  for (const JobRef job : state.simulation->on_the_way()) all.push_back(arrival_from(state, job));
  return all;
}

Time ExploredBranches::begin_to_release(ExploredState& state, bool begun_without) {
  Time next = kNever;
  for (const Timer& timer : state.scheduler->timers()) {
    const JobRef release = release_of(timer.next_job());
    if (!timer.is_held() || state.start_of(release) != kConstant) continue;
    if (timer.next_call() > state.from) {
      next = std::min(next, timer.next_call());
      continue;
    }
    const std::int64_t earliest = (timer.next_call() - Time{}).count();
    state.starts.push_back(release);
    state.zone.assign(state.zone.grow(), kConstant, earliest + (begun_without ? 1 : 0),
                      earliest + timer.release_jitter().count());
  }
  return next;
}

std::vector<ExploredBranches::Instant> ExploredBranches::releases(const ExploredState& state) {
  std::vector<Instant> all;
  for (const Timer& timer : state.scheduler->timers()) {
    if (!timer.is_held()) continue;
    const std::size_t coordinate = state.start_of(release_of(timer.next_job()));
    if (coordinate != kConstant) all.push_back({coordinate, 0, timer.task()});
  }
  return all;
}

std::vector<ExploredBranches::Instant> ExploredBranches::uncertain(const ExploredState& state) const {
  std::vector<Instant> all = ends_of_threads(state);
  for (const Instant& release : releases(state)) all.push_back(release);
  if (const std::vector<Instant> arriving = arrivals(state); !arriving.empty()) {
    all.push_back(arriving.front());
  }
  return all;
}

std::vector<ExploredBranches::Branch> ExploredBranches::until(const ExploredState& state, Time others,
                                                              Time change) const {
  std::vector<Branch> branches;
  std::vector<Instant> ends = ends_of_threads(state);
  for (const Instant& release : releases(state)) ends.push_back(release);
  const std::vector<Instant> arriving = arrivals(state);
  const Time limit = std::min(others, change);
  const auto before_limit = [&](std::optional<Branch>& branch) {
    return branch && (limit == kNever || branch->zone.limit(kNow, kConstant, (limit - Time{}).count() - 1));
  };
  for (std::size_t arrived = 0; arrived <= arriving.size(); ++arrived) {
    if (others <= change && others != kNever) {
      auto branch = at(state, {kConstant, (others - Time{}).count()}, arriving, arrived);
      if (branch) choose(state, ends, 0, std::move(*branch), branches);
    }
    if (arrived > 0) {
      auto branch = at(state, arriving.front(), arriving, arrived);
      if (before_limit(branch)) choose(state, ends, 0, std::move(*branch), branches);
      continue;
    }
    for (std::size_t first = 0; first < ends.size(); ++first) {
      auto branch = at(state, ends[first], arriving, arrived);
      bool is_first = before_limit(branch);
      for (std::size_t i = 0; i < first && is_first; ++i) {
        is_first = branch->zone.limit(kNow, ends[i].coordinate, ends[i].later - 1);
      }
      if (is_first) choose(state, ends, first, std::move(*branch), branches);
    }
  }
  return branches;
}

std::optional<ExploredBranches::Branch> ExploredBranches::at(const ExploredState& state, const Instant& now,
                                                             const std::vector<Instant>& arriving,
                                                             std::size_t arrived) const {
  Branch branch{state.zone};
  Zone& zone = branch.zone;
  zone.assign(kNow, now.coordinate, now.later, now.later);
  for (std::size_t i = 0; i < arrived; ++i) {
    if (!zone.equate(kNow, arriving[i].coordinate, arriving[i].later)) return std::nullopt;
  }
  if (arrived < arriving.size()) {
    const Instant& next = arriving[arrived];
    if (!zone.limit(kNow, next.coordinate, next.later - 1)) return std::nullopt;
  }
  return branch;
}

void ExploredBranches::choose(const ExploredState& state, const std::vector<Instant>& ends, std::size_t next,
                              Branch branch, std::vector<Branch>& branches) const {
  if (next == ends.size()) return add(state, std::move(branch), branches);
  const Instant& end = ends[next];
  Branch later = branch;
  if (later.zone.limit(kNow, end.coordinate, end.later - 1)) {
    choose(state, ends, next + 1, std::move(later), branches);
  }
  if (!branch.zone.equate(kNow, end.coordinate, end.later)) return;
  if (end.release != kNoTask) {
    branch.releases.push_back(end.release);
  } else if (end.coordinate == kEnd) {
    branch.step_ends = state.runs();
  }
  choose(state, ends, next + 1, std::move(branch), branches);
}

void ExploredBranches::add(const ExploredState& state, Branch branch, std::vector<Branch>& branches) const {
  if (!slices || !state.runs() || slice_matters(state)) return branches.push_back(std::move(branch));
  // A timer thread that becomes ready now gets the core at once if the time slice is over.
  Branch over = branch;
  if (over.zone.limit(kSlice, kNow, 0)) branches.push_back(std::move(over));
  if (branch.zone.limit(kNow, kSlice, -1)) branches.push_back(std::move(branch));
}

}  // namespace hotpath
