// SPDX-License-Identifier: Apache-2.0
#include "explored_state.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

namespace hotpath {

namespace {

using Instants = std::vector<UncertainInstant>;

/// The uncertain instants but for arrivals.
Instants ends(const ExploredState& state) {
  Instants all;
  if (state.simulation->several()) {
    for (const Worker w : state.running()) all.push_back({state.end_of_job(w)});
    return all;
  }
  if (state.runs() || state.wakes) all.push_back({kEnd});
  if (state.runs() && state.slice_matters()) all.push_back({kSlice});
  if (state.releases) all.push_back({kTimers});
  for (const Timer& timer : state.simulation->scheduler().timers()) {
    if (!timer.is_held()) continue;
    const std::size_t coordinate = state.start_of(release_of(timer.next_job()));
    if (coordinate != kConstant) all.push_back({coordinate, 0, timer.task()});
  }
  return all;
}

/// When the samples that the job published arrive.
UncertainInstant arrival_from(const ExploredState& state, JobRef job) {
  return {state.start_of(publication_by(job)), state.simulation->delivery_delay().count()};
}

/// When the samples on the way arrive, in that order.
Instants arrivals(const ExploredState& state) {
  Instants all;
  for (const JobRef job : state.simulation->on_the_way()) all.push_back(arrival_from(state, job));
  return all;
}

/// The schedules in which something happens at `now`, with the first `arrived` samples on the way and
/// before the next one.
std::optional<Branch> at(const ExploredState& state, const UncertainInstant& now, const Instants& arriving,
                         std::size_t arrived) {
  Branch branch{state.zone};
  Zone& zone = branch.zone;
  zone.assign(kNow, now.coordinate, now.later, now.later);
  for (std::size_t i = 0; i < arrived; ++i) {
    if (!zone.equate(kNow, arriving[i].coordinate, arriving[i].later)) return std::nullopt;
  }
  if (arrived < arriving.size()) {
    const UncertainInstant& next = arriving[arrived];
    if (!zone.limit(kNow, next.coordinate, next.later - 1)) return std::nullopt;
  }
  return branch;
}

void add(const ExploredState& state, Branch branch, std::vector<Branch>& branches) {
  if (!state.simulation->shares_core() || !state.runs() || state.slice_matters())
    return branches.push_back(std::move(branch));
  // A timer thread that becomes ready now gets the core at once if the time slice is over.
  Branch over = branch;
  if (over.zone.limit(kSlice, kNow, 0)) branches.push_back(std::move(over));
  if (branch.zone.limit(kNow, kSlice, -1)) branches.push_back(std::move(branch));
}

/// How far behind this instant an end lies that is not one of it. Several threads act one after the other,
/// so that some may do so at an instant while the others still run.
std::int64_t after(const ExploredState& state) { return state.simulation->several() ? 0 : 1; }

/// Adds the schedules of `branch` in which each of `ends` from number `next` on is now or later.
void choose(const ExploredState& state, const Instants& ends, std::size_t next, Branch branch,
            std::vector<Branch>& branches) {
  if (next == ends.size()) return add(state, std::move(branch), branches);
  const UncertainInstant& end = ends[next];
  Branch later = branch;
  if (later.zone.limit(kNow, end.coordinate, end.later - after(state))) {
    choose(state, ends, next + 1, std::move(later), branches);
  }
  if (!branch.zone.equate(kNow, end.coordinate, end.later)) return;
  if (state.simulation->several()) {
    branch.ends.push_back(end.coordinate);
  } else if (end.release != kNoTask) {
    branch.releases.push_back(end.release);
  } else if (end.coordinate == kEnd) {
    branch.step_ends = state.runs();
  }
  choose(state, ends, next + 1, std::move(branch), branches);
}

}  // namespace

Time ExploredState::next_of_others() const {
  SimulatedWorkers& workers = simulation->workers();
  std::vector<SimulatedWorkers::State> all;
  for (Worker w = 0; w < workers.size(); ++w) all.push_back(workers[w]);
  if (simulation->several()) {
    for (const Worker w : running()) workers[w].until = kNever;
  } else if (runs())
    executor().until = executor().slice_end = kNever;
  if (releases) timers().until = timers().slice_end = kNever;
  if (wakes) workers.sleep_until(kExecutor, kNever);
  if (timers_wake()) workers.sleep_until(kTimerThread, kNever);
  const Time next = simulation->next_of_threads();
  for (Worker w = 0; w < workers.size(); ++w) {
    if (all[w].step == Step::asleep) workers.sleep_until(w, all[w].until);
    workers[w].until = all[w].until;
    workers[w].slice_end = all[w].slice_end;
  }
  return next;
}

bool ExploredState::slice_matters() const {
  return simulation->shares_core() && !timers().on_core && timers().step != Step::asleep &&
         timers().step != Step::blocked;
}

std::vector<UncertainInstant> ExploredState::uncertain() const {
  Instants all = ends(*this);
  if (const Instants arriving = arrivals(*this); !arriving.empty()) all.push_back(arriving.front());
  return all;
}

Time ExploredState::begin_to_release(bool begun_without) {
  Time next = kNever;
  for (const Timer& timer : simulation->scheduler().timers()) {
    const JobRef release = release_of(timer.next_job());
    if (!timer.is_held() || start_of(release) != kConstant) continue;
    if (timer.next_call() > from) {
      next = std::min(next, timer.next_call());
      continue;
    }
    const std::int64_t earliest = (timer.next_call() - Time{}).count();
    starts.push_back(release);
    zone.assign(zone.grow(), kConstant, earliest + (begun_without ? 1 : 0),
                earliest + timer.release_jitter().count());
  }
  return next;
}

void ExploredState::move_to(const Branch& branch, const std::vector<std::int64_t>& point) {
  SimulatedWorkers& workers = simulation->workers();
  SimulatedWorkers::State& executor = this->executor();
  const auto instant = [&](std::size_t coordinate) { return Time{} + Duration(point[coordinate]); };
  if (simulation->several()) {
    for (const Worker w : running()) {
      workers[w].until = workers[w].step_end = instant(end_of_job(w));
      const bool ends = std::ranges::find(branch.ends, end_of_job(w)) != branch.ends.end();
      workers[w].rounds = ends ? 0 : 2;  // not in this one
      if (ends) ended.push_back(w);
    }
    return;
  }
  if (runs()) {
    executor.until = executor.step_end = instant(kEnd);
    end_there = point[kEnd];
    if (simulation->shares_core()) executor.slice_end = instant(kSlice);
  }
  if (wakes) workers.sleep_until(kExecutor, instant(kEnd));
  if (timers_wake()) {
    workers.sleep_until(kTimerThread, instant(kTimers));
  } else if (releases) {
    SimulatedWorkers::State& timers = this->timers();
    const Duration slice = timers.slice_end - timers.until;
    timers.until = timers.step_end = instant(kTimers);
    timers.slice_end = timers.until + slice;
    if (busy() && !executor.on_core) {  // displaced since the release began
      executor.until = executor.step_end = instant(kEnd);
      executor.remaining = executor.until - (timers.until - timers.remaining);
      end_there = point[kEnd];
    }
  }
  simulation->reschedule_arrivals([&](JobRef job) {
    const UncertainInstant arrival = arrival_from(*this, job);
    return instant(arrival.coordinate) + Duration(arrival.later);
  });
}

std::vector<Branch> ExploredState::branches(Time others, Time change) const {
  std::vector<Branch> all;
  const Instants ending = ends(*this), arriving = arrivals(*this);
  const Time limit = std::min(others, change);
  const auto before_limit = [&](std::optional<Branch>& branch) {
    return branch && (limit == kNever || branch->zone.limit(kNow, kConstant, (limit - Time{}).count() - 1));
  };
  for (std::size_t arrived = 0; arrived <= arriving.size(); ++arrived) {
    if (others <= change && others != kNever) {
      auto branch = at(*this, {kConstant, (others - Time{}).count()}, arriving, arrived);
      if (branch) choose(*this, ending, 0, std::move(*branch), all);
    }
    if (arrived > 0) {
      auto branch = at(*this, arriving.front(), arriving, arrived);
      if (before_limit(branch)) choose(*this, ending, 0, std::move(*branch), all);
      continue;
    }
    for (std::size_t first = 0; first < ending.size(); ++first) {
      auto branch = at(*this, ending[first], arriving, arrived);
      bool is_first = before_limit(branch);
      for (std::size_t i = 0; i < first && is_first; ++i) {
        is_first = branch->zone.limit(kNow, ending[i].coordinate, ending[i].later - after(*this));
      }
      if (is_first) choose(*this, ending, first, std::move(*branch), all);
    }
  }
  return all;
}

}  // namespace hotpath
