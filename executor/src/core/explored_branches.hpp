// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "explored_state.hpp"

namespace hotpath {

/// What can happen next in an explored state.
struct ExploredBranches {
  /// An instant that depends on execution times: this long after that coordinate.
  struct Instant {
    std::size_t coordinate;
    std::int64_t later;
  };
  /// Schedules in which the same happens next.
  struct Branch {
    Zone zone;
    bool step_ends;
  };

  bool slices = false;  ///< The two threads share a core in turns.
  std::int64_t delivery_delay = 0;

  /// The next instant that does not depend on execution times.
  static Time next_of_others(ExploredState& state);
  /// Whether the timer thread waits for the executor thread's core until the end of the time slice.
  [[nodiscard]] bool slice_matters(const ExploredState& state) const;
  /// When the step, the sleep and the time slice of the executor thread end, and the timer thread's release.
  [[nodiscard]] std::vector<Instant> ends_of_threads(const ExploredState& state) const;
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
  /// The instant before which, or at which, something happens next.
  struct Limit {
    Time instant;
    bool reached;
  };
  /// What happens next, together, and what later.
  struct Order {
    std::vector<Instant> now, later;
    bool step_ends;
  };
  /// Adds the schedules of this order in which nothing else happens before the limit.
  void add(const ExploredState& state, const Order& order, const Limit& limit,
           std::vector<Branch>& branches) const;
};

}  // namespace hotpath
