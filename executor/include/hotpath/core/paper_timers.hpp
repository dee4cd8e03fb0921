// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The utilisations, in percent, of the paper's timers-only task sets (Section VII-A).
inline constexpr std::array kPaperUtilisations = {60, 80, 90};

/// The paper's timers-only task set of one of these utilisations: two LiDARs, four cameras, IMU, in the order
/// of creation and by the names of graphs/timers_only_*.yaml. Throws std::invalid_argument for another
/// utilisation.
[[nodiscard]] TaskSet paper_timers(int utilisation_percent);

}  // namespace hotpath
