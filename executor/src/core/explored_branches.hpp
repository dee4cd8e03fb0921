// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "explored_state.hpp"

namespace hotpath {

/// What can happen next in an explored state.
struct ExploredBranches {
  /// An instant that depends on execution times: this long after that coordinate.
  struct Instant {
    std::size_t coordinate;
    std::int64_t later;
    TaskId release = kNoTask;  ///< It is the release of this timer.
  };
  /// Schedules in which the same happens next.
  struct Branch {
    Zone zone = Zone();
    bool step_ends = false;
    std::vector<TaskId> releases{};
  };

  bool slices = false;  ///< The two threads share a core in turns.
  std::int64_t delivery_delay = 0;

  /// The next instant that does not depend on execution times.
  static Time next_of_others(ExploredState& state);
  /// Whether the timer thread waits for the executor thread's core until the end of the time slice.
  [[nodiscard]] bool slice_matters(const ExploredState& state) const;
  /// When the step, the sleep and the time slice of the executor thread end, and the timer thread's release.
  [[nodiscard]] std::vector<Instant> ends_of_threads(const ExploredState& state) const;
  /// Makes the releases whose timestamps have come coordinates, all of them later than their timestamps if
  /// the executor has begun without them; returns the next such timestamp.
  static Time begin_to_release(ExploredState& state, bool begun_without = false);
  /// When timers are released whose timestamps have passed.
  [[nodiscard]] static std::vector<Instant> releases(const ExploredState& state);
  /// All of these and the first arrival: something happens at the first of them.
  [[nodiscard]] std::vector<Instant> uncertain(const ExploredState& state) const;
  /// Gives the simulation of `state` the instants of its zone at this point.
  void move_to(const std::vector<std::int64_t>& point, ExploredState& state) const;
  /// When the samples that the job published arrive.
  [[nodiscard]] Instant arrival_from(const ExploredState& state, JobRef job) const {
    return {state.start_of(publication_by(job)), delivery_delay};
  }
  /// When the samples on the way arrive, in that order.
  [[nodiscard]] std::vector<Instant> arrivals(const ExploredState& state) const;
  /// Everything that can happen next, at `others` or before it, and before `change`.
  [[nodiscard]] std::vector<Branch> until(const ExploredState& state, Time others, Time change) const;

 private:
  /// The schedules in which something happens at `now`, with the first `arrived` samples on the way and
  /// before none of the `others`.
  [[nodiscard]] std::optional<Branch> at(const ExploredState& state, const Instant& now,
                                         const std::vector<Instant>& arriving, std::size_t arrived) const;
  /// Adds the schedules of `branch` in which each of `ends` from number `next` on is now or later.
  void choose(const ExploredState& state, const std::vector<Instant>& ends, std::size_t next, Branch branch,
              std::vector<Branch>& branches) const;
  void add(const ExploredState& state, Branch branch, std::vector<Branch>& branches) const;
};

}  // namespace hotpath
