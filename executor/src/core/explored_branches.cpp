// SPDX-License-Identifier: Apache-2.0
#include "explored_branches.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace hotpath {

namespace {

constexpr Worker kTimers = 1;  // if there is one

}  // namespace

Time ExploredBranches::next_of_others(ExploredState& state) {
  SimulatedWorkers::State& executor = state.executor();
  if (!state.runs()) return state.simulation->next_of_threads();
  const Time until = std::exchange(executor.until, kNever);
  const Time slice = std::exchange(executor.slice_end, kNever);
  const Time next = state.simulation->next_of_threads();
  executor.until = until;
  executor.slice_end = slice;
  return next;
}

bool ExploredBranches::slice_matters(const ExploredState& state) const {
  if (!slices) return false;
  const SimulatedWorkers::State& timers = state.simulation->workers()[kTimers];
  return !timers.on_core && timers.step != ExploredState::Step::asleep &&
         timers.step != ExploredState::Step::blocked;
}

std::vector<ExploredBranches::Instant> ExploredBranches::ends_of_thread(const ExploredState& state) const {
  if (!state.runs()) return {};
  std::vector<Instant> ends = {{kEnd, 0}};
  if (slice_matters(state)) ends.push_back({kSlice, 0});
  return ends;
}

std::vector<ExploredBranches::Instant> ExploredBranches::arrivals(const ExploredState& state) const {
  std::vector<Instant> all;
  for (const JobRef job : state.simulation->on_the_way()) all.push_back(arrival_from(state, job));
  return all;
}

std::vector<ExploredBranches::Branch> ExploredBranches::until(const ExploredState& state, Time others,
                                                              Time change) const {
  std::vector<Branch> branches;
  const std::vector<Instant> ends = ends_of_thread(state), arriving = arrivals(state);
  const Time limit = std::min(others, change);
  const unsigned subsets = 1U << ends.size();
  for (std::size_t arrived = 0; arrived <= arriving.size(); ++arrived) {
    for (unsigned subset = 0; subset < subsets; ++subset) {
      Order order;
      order.step_ends = (subset & 1U) != 0;
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
