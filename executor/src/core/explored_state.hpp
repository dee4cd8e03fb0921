// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "explored_simulation.hpp"
#include "zone.hpp"

namespace hotpath {

/// The release of a timer's job, as an instant of ExploredState::starts.
[[nodiscard]] inline JobRef release_of(JobRef job) {
  constexpr TaskId kRelease = TaskId{1} << 30;
  return {job.task | kRelease, job.sequence};
}

/// Coordinates of a state's zone. Those that mean nothing in a state are 0 there.
enum Coordinate : std::size_t {
  kConstant,
  kNow,     ///< The instant at hand.
  kEnd,     ///< Of the executor thread's step, or of its sleep.
  kSlice,   ///< End of the executor thread's time slice.
  kTimers,  ///< End of the timer thread's release, or of its sleep.
  kStarts   ///< From here on: the instants of ExploredState::starts.
};

struct ExploredState {
  using Step = SimulatedWorkers::Step;
  static constexpr Worker kExecutor = 0, kTimerThread = 1;  // the latter if there is one

  std::unique_ptr<ExploredScheduler> scheduler;
  std::unique_ptr<Workload> workload;
  std::unique_ptr<ExploredSimulation> simulation;
  Zone zone{kStarts};
  std::vector<JobRef> starts;  ///< Jobs, for their starts, or publication_by() or release_of() jobs.
  Time from{};                 ///< Of all instants of the zone, none is earlier; no timestamp lies between.
  std::int64_t end_there = 0;  ///< The end of the step in `simulation`, which is one of those in `zone`.
  // Whether the ends of the executor thread's sleep, and of the timer thread's sleep or release, are
  // uncertain.
  bool wakes = false, releases = false;
  // What happened at the last instant: releases, by timer and timestamp; whether a job began.
  std::vector<std::pair<TaskId, Time>> released;
  bool job_began = false;

  [[nodiscard]] SimulatedWorkers::State& executor() { return simulation->workers()[kExecutor]; }
  [[nodiscard]] const SimulatedWorkers::State& executor() const { return simulation->workers()[kExecutor]; }
  /// Whether the thread is within a step that takes time, with or without a core.
  [[nodiscard]] bool busy() const {
    return executor().step == Step::run || executor().step == Step::dispatch ||
           executor().step == Step::release;
  }
  /// Whether time passes for that step.
  [[nodiscard]] bool runs() const { return busy() && executor().on_core; }
  /// Whether the timer thread sleeps until an uncertain instant.
  [[nodiscard]] bool timers_wake() const {
    return releases && simulation->workers()[kTimerThread].step == Step::asleep;
  }
  [[nodiscard]] ExploredState copy() const {
    ExploredState copied;
    copied.scheduler = scheduler->clone();
    copied.workload = workload->clone();
    copied.simulation = simulation->copy(*copied.scheduler, *copied.workload);
    copied.zone = zone;
    copied.starts = starts;
    copied.from = from;
    copied.end_there = end_there;
    copied.wakes = wakes;
    copied.releases = releases;
    copied.released = released;
    copied.job_began = job_began;
    return copied;
  }
  [[nodiscard]] std::size_t start_of(JobRef job) const {
    const auto place = std::find(starts.begin(), starts.end(), job);
    return place == starts.end() ? kConstant : kStarts + static_cast<std::size_t>(place - starts.begin());
  }
};

}  // namespace hotpath
