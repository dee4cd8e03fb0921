// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/exploration.hpp"
#include "zone.hpp"

namespace hotpath {

/// A job that began, with the coordinate of its end, and what tells it from others that run.
struct BegunJob {
  TaskId task;
  std::size_t end;
  std::uint32_t name = 0;
};

/// A sample that was published, with the coordinate of its arrival; 0: at once.
struct SentSample {
  TaskId subscription;
  std::size_t arrival;
};

/// What happened at one instant of an exploration.
struct Happened {
  std::vector<BegunJob> begun{};                    ///< Jobs that take time, in this order.
  std::vector<std::uint32_t> ended{};               ///< Of several threads: names of jobs.
  std::vector<SentSample> sent{};                   ///< Published samples, in this order.
  std::vector<std::pair<TaskId, Time>> released{};  ///< Timers, with their timestamps.
};

/// How an exploration came to its states, to find a schedule that leads to one of them.
class ExploredPaths {
 public:
  static constexpr std::size_t kNowhere = ~std::size_t{0};  ///< Before the first state.

  /// A state, and which coordinates of a zone are those of the state.
  struct End {
    std::size_t state = kNowhere;
    std::vector<std::size_t> coordinates;
    std::int64_t origin = 0;  ///< Of the zone's instants in the state.
  };

  /// What leads from one state to the next, or to an instant that was to be kept.
  struct Edge {
    Zone zone;  ///< Of all schedules that go this way, with the coordinates of both states.
    End from, to;
    Happened happened;  ///< At kNow, when the next state begins.
  };

  void add(Edge edge) {
    if (edges_.size() <= edge.to.state) edges_.resize(edge.to.state + 1);
    edges_[edge.to.state].push_back(std::move(edge));
  }

  /// A schedule of the last edge's zone.
  [[nodiscard]] Witness witness(const Edge& last) const;

 private:
  struct Step {
    const Edge* edge;
    std::vector<std::int64_t> point;  ///< Of its zone.
    std::int64_t origin = 0;          ///< Of the point.
  };

  /// The first edge that leads to the state at this point of the next edge's zone. It was there before the
  /// next edge, so that a path ends.
  [[nodiscard]] Step edge_to(const End& end, const std::vector<std::int64_t>& point) const;

  std::deque<std::vector<Edge>> edges_;  // by the state to which they lead
};

}  // namespace hotpath
