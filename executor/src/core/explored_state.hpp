// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "explored_paths.hpp"
#include "explored_simulation.hpp"
#include "zone.hpp"

namespace hotpath {

[[nodiscard]] inline JobInstant arrival_of(const ExploredSimulation::Sample& sample) {
  return {{sample.subscription, sample.number}, JobInstant::Kind::arrival};
}

/// Coordinates of a state's zone. Those that mean nothing in a state are 0 there.
enum : std::size_t {
  kConstant,
  kNow,      ///< The instant at hand.
  kEnd,      ///< Of the executor thread's step, or of its sleep.
  kSlice,    ///< End of the executor thread's time slice.
  kTimers,   ///< End of the timer thread's release, or of its sleep.
  kInstants  ///< From here on: those of ExploredState::instants.
};

/// An instant that depends on execution times, releases or deliveries.
struct UncertainInstant {
  std::size_t coordinate;
  TaskId release = kNoTask;  ///< It is the release of this timer.
};

/// Schedules in which the same happens next.
struct Branch {
  Zone zone = Zone();
  bool step_ends = false;
  std::vector<TaskId> releases{};
  std::vector<std::size_t> now{};  ///< Coordinates of the samples that arrive, or of several threads' ends.
};

/// A state of an exploration. A copy has a simulation of its own.
struct ExploredState {
  using Step = SimulatedWorkers::Step;
  static constexpr Worker kExecutor = 0, kTimerThread = 1;  // the latter if there is one

  Cloned<ExploredSimulation> simulation;
  Zone zone{kInstants};
  std::vector<JobInstant> instants{};
  Time from{};                 ///< Of all instants of the zone, none is earlier; no timestamp lies between.
  std::int64_t end_there = 0;  ///< The end of the step in `simulation`, which is one of those in `zone`.
  // Whether the ends of the executor thread's sleep, and of the timer thread's sleep or release, are
  // uncertain.
  bool wakes = false, releases = false;
  Happened happened{};  ///< At the last instant.

  [[nodiscard]] SimulatedWorkers::State& executor() const { return simulation->workers()[kExecutor]; }
  /// The timer thread, if there is one.
  [[nodiscard]] SimulatedWorkers::State& timers() const { return simulation->workers()[kTimerThread]; }
  /// Whether the thread is within a step that takes time, with or without a core.
  [[nodiscard]] bool busy() const {
    return executor().step == Step::run || executor().step == Step::dispatch ||
           executor().step == Step::release;
  }
  /// Whether time passes for that step.
  [[nodiscard]] bool runs() const { return busy() && executor().on_core; }
  /// Whether the timer thread sleeps until an uncertain instant.
  [[nodiscard]] bool timers_wake() const { return releases && timers().step == Step::asleep; }
  /// Threads that are alike may have swapped their jobs on other ways to the state, but no task runs twice.
  [[nodiscard]] std::uint32_t name_of_job(Worker w) const {
    return simulation->scheduler().threads_alike() ? simulation->workers()[w].record.job.task : w;
  }
  [[nodiscard]] std::size_t end_of_job(Worker w) const {
    return coordinate_of({simulation->workers()[w].record.job.ref(), JobInstant::Kind::end});
  }
  /// kConstant: it has none.
  [[nodiscard]] std::size_t coordinate_of(const JobInstant& instant) const {
    const auto place = std::find(instants.begin(), instants.end(), instant);
    return place == instants.end() ? kConstant
                                   : kInstants + static_cast<std::size_t>(place - instants.begin());
  }

  /// A new instant, in [low, high] from now on; returns its coordinate.
  std::size_t track(const JobInstant& instant, std::int64_t low = 0, std::int64_t high = 0) {
    instants.push_back(instant);
    return zone.add(kNow, low, high);
  }

  /// The next instant that does not depend on execution times.
  [[nodiscard]] Time next_of_others() const;
  /// Whether the timer thread waits for the executor thread's core until the end of the time slice.
  [[nodiscard]] bool slice_matters() const;
  /// When the step, the sleep and the time slice of the executor thread end, and the timer thread's release;
  /// when timers are released whose timestamps have passed; and when samples arrive. Something happens at the
  /// first of them.
  [[nodiscard]] std::vector<UncertainInstant> uncertain() const;
  /// Makes the releases whose timestamps have come coordinates, all of them later than their timestamps if
  /// the executor has begun without them; returns the next such timestamp.
  Time begin_to_release(bool begun_without = false);
  /// Gives the simulation the instants of the branch at this point of its zone.
  void move_to(const Branch& branch, const std::vector<std::int64_t>& point);
  /// Everything that can happen next, at `others` or before it, and before `change`.
  [[nodiscard]] std::vector<Branch> branches(Time others, Time change) const;
};

/// The samples that are published at one instant of an exploration: some arrive at once, before their
/// publisher's thread goes on; the others at an instant that is a coordinate.
class ExploredDeliveries final : public Deliveries {
 public:
  /// Calls `happens`, in which samples are published, for each choice of those that arrive at once.
  template <class Happens>
  void for_each_choice(const Happens& happens) {
    at_once_.clear();
    do {
      sent_.clear();
      happens();
      while (!at_once_.empty() && at_once_.back()) at_once_.pop_back();
      if (!at_once_.empty()) at_once_.back() = true;
    } while (!at_once_.empty());
  }

  [[nodiscard]] Duration of(TaskId subscription, std::uint64_t number, Duration longest) const override {
    constexpr std::size_t kMost = 12;
    if (sent_.size() == kMost) {
      throw ExplorationRefused("more than 12 samples may be published at one instant",
                               ExplorationRefused::Why::stopped);
    }
    if (at_once_.size() == sent_.size()) at_once_.push_back(false);
    sent_.emplace_back(subscription, number);
    return at_once_[sent_.size() - 1] ? Duration{} : longest;
  }

  /// Gives the samples that were published now, and are on their way, a coordinate each for their arrival.
  void note(ExploredState& state, Duration longest) const {
    if (sent_.empty()) return;
    const std::deque<ExploredSimulation::Sample>& on_the_way = state.simulation->on_the_way();
    for (const auto& [subscription, number] : sent_) {
      state.happened.sent.push_back({subscription, 0});
      for (const ExploredSimulation::Sample& sample : on_the_way) {
        if (sample.subscription != subscription || sample.number != number) continue;
        const std::size_t arrival = state.track(arrival_of(sample), 1, longest.count());
        state.happened.sent.back().arrival = arrival;
        for (const ExploredSimulation::Sample& earlier : on_the_way) {
          if (!earlier.goes_before(sample)) continue;
          [[maybe_unused]] const bool any =
              state.zone.limit(state.coordinate_of(arrival_of(earlier)), arrival, 0);
          assert(any && "a sample that overtakes another");
        }
      }
    }
  }

 private:
  // By subscription and number, in the order of publication; and whether each arrives at once.
  mutable std::vector<std::pair<TaskId, std::uint64_t>> sent_;
  mutable std::vector<bool> at_once_;
};

/// `scheduler`, as that of a system that is explored. Throws ExplorationRefused for any other, and for what
/// is not covered beside it: several threads that run jobs need a core each, and only jobs take time then.
const ExploredScheduler& explorable(const TaskSet& set, const ExplorationOptions& options,
                                    const Scheduler& scheduler, const Workload& workload);

}  // namespace hotpath
