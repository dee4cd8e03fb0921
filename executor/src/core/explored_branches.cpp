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

std::vector<ExploredBranches::Branch> ExploredBranches::until(const ExploredState& state, Time others,
                                                              Time change) const {
  std::vector<Branch> branches;
  const std::vector<Instant> ends = ends_of_threads(state), arriving = arrivals(state);
  const Time limit = std::min(others, change);
  const unsigned subsets = 1U << ends.size();
  for (std::size_t arrived = 0; arrived <= arriving.size(); ++arrived) {
    for (unsigned subset = 0; subset < subsets; ++subset) {
      Order order;
      order.step_ends = state.runs() && (subset & 1U) != 0;
      order.now.assign(arriving.begin(), arriving.begin() + static_cast<std::ptrdiff_t>(arrived));
      if (arrived < arriving.size()) order.later.push_back(arriving[arrived]);
      for (std::size_t i = 0; i < ends.size(); ++i) {
        (((subset >> i) & 1U) != 0 ? order.now : order.later).push_back(ends[i]);
      }
      if (!order.now.empty()) add(state, order, {limit, false}, branches);
      if (others <= change && others != kNever) add(state, order, {limit, true}, branches);
    }
  }
  return branches;
}

void ExploredBranches::add(const ExploredState& state, const Order& order, const Limit& limit,
                           std::vector<Branch>& branches) const {
  Zone zone = state.zone;
  const std::int64_t ns = (limit.instant - Time{}).count();
  const Instant first = limit.reached ? Instant{kConstant, ns} : order.now.front();
  zone.assign(kNow, first.coordinate, first.later, first.later);
  for (const Instant& instant : order.now) {
    if (!zone.equate(kNow, instant.coordinate, instant.later)) return;
  }
  for (const Instant& instant : order.later) {
    if (!zone.limit(kNow, instant.coordinate, instant.later - 1)) return;
  }
  if (!limit.reached && limit.instant != kNever && !zone.limit(kNow, kConstant, ns - 1)) return;
  if (!slices || !state.runs() || slice_matters(state)) {
    branches.push_back({std::move(zone), order.step_ends});
    return;
  }
  // A timer thread that becomes ready now gets the core at once if the time slice is over.
  Zone over = zone;
  if (over.limit(kSlice, kNow, 0)) branches.push_back({std::move(over), order.step_ends});
  if (zone.limit(kNow, kSlice, -1)) branches.push_back({std::move(zone), order.step_ends});
}

}  // namespace hotpath
