// SPDX-License-Identifier: Apache-2.0
#include "explored_state.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

namespace hotpath {

namespace {

using Instants = std::vector<UncertainInstant>;

void add(const ExploredState& state, Branch branch, std::vector<Branch>& branches) {
  if (!state.simulation->shares_core() || !state.runs() || state.slice_matters())
    return branches.push_back(std::move(branch));
  // A timer thread that becomes ready now gets the core at once if the time slice is over.
  Branch over = branch;
  if (over.zone.limit(kSlice, kNow, 0)) branches.push_back(std::move(over));
  if (branch.zone.limit(kNow, kSlice, -1)) branches.push_back(std::move(branch));
}

/// How far behind this instant one of those lies that do not happen now. Several threads act one after the
/// other, so that some may do so at an instant while the others still run.
std::int64_t after(const ExploredState& state) { return state.simulation->several() ? 0 : 1; }

/// Adds the schedules of `branch` in which each of `ends` from number `next` on is now or later.
void choose(const ExploredState& state, const Instants& ends, std::size_t next, Branch branch,
            std::vector<Branch>& branches) {
  if (next == ends.size()) return add(state, std::move(branch), branches);
  const UncertainInstant& end = ends[next];
  Branch later = branch;
  if (later.zone.limit(kNow, end.coordinate, -after(state))) {
    choose(state, ends, next + 1, std::move(later), branches);
  }
  if (!branch.zone.equate(kNow, end.coordinate)) return;
  if (end.coordinate >= kInstants && end.release == kNoTask) {
    branch.now.push_back(end.coordinate);
  } else if (end.release != kNoTask) {
    branch.releases.push_back(end.release);
  } else if (end.coordinate == kEnd) {
    branch.step_ends = state.runs();
  }
  choose(state, ends, next + 1, std::move(branch), branches);
}

/// Throws ExplorationRefused for several threads that run jobs unless each has a core and only jobs take
/// time.
void check_threads(const TaskSet& set, const Platform& p, std::span<const WorkerRole> roles) {
  const auto threads = static_cast<std::size_t>(std::ranges::count(roles, WorkerRole::executor));
  const std::string several = "for an executor with several threads it ";
  const std::size_t cores = roles.size() > threads && !p.raised_releaser ? threads + 1 : threads;
  if (p.cores < cores)
    throw ExplorationRefused(several + "needs " + std::to_string(cores) + " cores, one each (--cores)");
  if (std::ranges::any_of(kAllCosts, [&](auto cost) { return p.*cost > Duration{}; }))
    throw ExplorationRefused(several + "covers no costs, wake-up latencies or delivery delays");
  for (const Task& task : set.tasks) {
    if (task.release_jitter > Duration{})
      throw ExplorationRefused(several + "does not cover the release jitter of " + task.name);
  }
}

}  // namespace

Time ExploredState::next_of_others() const {
  SimulatedWorkers workers = simulation->workers();
  if (simulation->several()) {
    for (const Worker w : workers.on_cores()) workers[w].until = kNever;
  } else if (runs()) {
    workers[kExecutor].until = workers[kExecutor].slice_end = kNever;
  }
  if (releases) workers[kTimerThread].until = workers[kTimerThread].slice_end = kNever;
  if (wakes) workers.sleep_until(kExecutor, kNever);
  if (timers_wake()) workers.sleep_until(kTimerThread, kNever);
  return workers.next_instant(simulation->now());
}

bool ExploredState::slice_matters() const {
  return simulation->shares_core() && !timers().on_core && !ExploredSimulation::waits(timers());
}

std::vector<UncertainInstant> ExploredState::uncertain() const {
  Instants all;
  if (simulation->several()) {
    for (const Worker w : simulation->workers().on_cores()) all.push_back({end_of_job(w)});
    return all;
  }
  if (runs() || wakes) all.push_back({kEnd});
  if (runs() && slice_matters()) all.push_back({kSlice});
  if (releases) all.push_back({kTimers});
  for (const Timer& timer : simulation->scheduler().timers()) {
    if (!timer.is_held()) continue;
    const std::size_t coordinate = coordinate_of({timer.next_job(), JobInstant::Kind::release});
    if (coordinate != kConstant) all.push_back({coordinate, timer.task()});
  }
  for (const auto& sample : simulation->on_the_way()) all.push_back({coordinate_of(arrival_of(sample))});
  return all;
}

Time ExploredState::begin_to_release(bool begun_without) {
  Time next = kNever;
  for (const Timer& timer : simulation->scheduler().timers()) {
    const JobInstant release{timer.next_job(), JobInstant::Kind::release};
    if (!timer.is_held() || coordinate_of(release) != kConstant) continue;
    if (timer.next_call() > from) {
      next = std::min(next, timer.next_call());
      continue;
    }
    const std::int64_t earliest = to_ns(timer.next_call());
    instants.push_back(release);
    zone.add(kConstant, earliest + (begun_without ? 1 : 0), earliest + timer.release_jitter().count());
  }
  return next;
}

void ExploredState::move_to(const Branch& branch, const std::vector<std::int64_t>& point) {
  SimulatedWorkers& workers = simulation->workers();
  SimulatedWorkers::State& executor = this->executor();
  const auto instant = [&](std::size_t coordinate) { return from_ns(point[coordinate]); };
  const auto happens_now = [&](std::size_t coordinate) {
    return std::ranges::find(branch.now, coordinate) != branch.now.end();
  };
  if (simulation->several()) {
    for (const Worker w : workers.on_cores()) {
      workers[w].until = workers[w].step_end = instant(end_of_job(w));
      const bool ends = happens_now(end_of_job(w));
      workers[w].rounds = ends ? 0 : 2;  // not in this one
      if (ends) happened.ended.push_back(name_of_job(w));
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
  simulation->reschedule_arrivals([&](const ExploredSimulation::Sample& sample) {
    return instant(kNow) + Duration(happens_now(coordinate_of(arrival_of(sample))) ? 0 : 1);
  });
}

std::vector<Branch> ExploredState::branches(Time others, Time change) const {
  std::vector<Branch> all;
  const Instants candidates = uncertain();
  const Time limit = std::min(others, change);
  const auto at = [&](std::size_t coordinate, std::int64_t later) {
    Branch branch{zone};
    branch.zone.assign(kNow, coordinate, later);
    return branch;
  };
  if (others <= change && others != kNever) choose(*this, candidates, 0, at(kConstant, to_ns(others)), all);
  for (std::size_t first = 0; first < candidates.size(); ++first) {
    Branch branch = at(candidates[first].coordinate, 0);
    bool is_first = limit == kNever || branch.zone.limit(kNow, kConstant, to_ns(limit) - 1);
    for (std::size_t i = 0; i < first && is_first; ++i) {
      is_first = branch.zone.limit(kNow, candidates[i].coordinate, -after(*this));
    }
    if (is_first) choose(*this, candidates, first, std::move(branch), all);
  }
  return all;
}

const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload) {
  const auto* explored = dynamic_cast<const ExploredScheduler*>(&scheduler);
  if (!explored || !explored->clone() || !workload.clone()) {
    throw ExplorationRefused("an executor whose timer thread runs jobs is not explored");
  }
  const auto threads = std::ranges::count(scheduler.workers(), WorkerRole::executor);
  if (threads > 1) check_threads(set, options.platform, scheduler.workers());
  const Platform& p = options.platform;
  const bool own_timers = scheduler.workers().size() > 1;
  if (own_timers && p.cores == 1 && p.wall_clock_work && p.release_cost + p.pass_cost > Duration{}) {
    throw ExplorationRefused("release costs that displace jobs with `work: wall` are not explored");
  }
  double load = 0;
  for (const Task& task : set.tasks) {
    if (task.always_due) throw ExplorationRefused("timer " + task.name + " has a period of 0");
    if (task.kind == TaskKind::timer) load += to_ms(task.wcet) / to_ms(task.period);
  }
  if (load > static_cast<double>(threads))
    throw ExplorationRefused(threads > 1 ? "the timers alone overload its threads"
                                         : "the timers alone overload the thread");
  return *explored;
}

}  // namespace hotpath
