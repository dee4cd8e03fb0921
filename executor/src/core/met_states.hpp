// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "explored_paths.hpp"
#include "explored_state.hpp"

namespace hotpath {

/// The states that an exploration has met. States that differ by hyperperiods only are the same; those that
/// are equal but for their zones are joined where the union is a zone.
class MetStates {
 public:
  /// `publications`: see ExplorationOptions. Throws ExplorationRefused if the timers of `set` have no common
  /// multiple of their periods.
  MetStates(const TaskSet& set, bool publications);

  struct Next {
    std::unique_ptr<ExploredState> state;
    ExploredPaths::End place;
  };
  /// The state in which something happens first, of those that were not expanded; none: all were.
  [[nodiscard]] std::optional<Next> next();

  /// Adds the state, unless it is part of one that was met. Tells `way` first where it is kept.
  void enter(ExploredState state, const std::function<void(const ExploredState&, ExploredPaths::End)>& way);

 private:
  /// By what it holds relative to its hyperperiod.
  struct Met {
    Zone zone;
    std::vector<std::size_t> coordinates;  // of the state's zone, in the order of `zone`
    std::int64_t origin = 0;
    std::unique_ptr<ExploredState> state;  // not yet expanded
  };

  /// What decides the state's future but for its zone; adds to `coordinates` which of the zone matter.
  [[nodiscard]] std::vector<std::int64_t> describe(const ExploredState& state, std::int64_t origin,
                                                   std::vector<std::size_t>& coordinates) const;
  /// Only the instants that `coordinates` names still matter.
  static void forget_other_instants(Met& met);
  /// The state's zone from what is known of it.
  static void take_over_zone(Met& met);
  /// When something happens next in the state.
  [[nodiscard]] static std::int64_t earliest(const Met& met);

  const std::int64_t hyperperiod_;  // of the timers, in ns
  const bool publications_;
  std::deque<Met> met_;
  std::map<std::vector<std::int64_t>, std::vector<std::size_t>> known_;  // places in met_
  using Pending = std::pair<std::int64_t, std::size_t>;                  // earliest, place in met_
  std::priority_queue<Pending, std::vector<Pending>, std::greater<>> pending_;
};

}  // namespace hotpath
