// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The utilisations, in percent, of the paper's timers-only task sets (Section VII-A).
inline constexpr std::array kPaperUtilisations = {60, 80, 90};

/// The paper's timers-only task set with one of these utilisations: two LiDARs, four cameras and an
/// IMU, in order of creation, with the names of graphs/timers_only_*.yaml. Throws
/// std::invalid_argument for any other utilisation.
[[nodiscard]] TaskSet paper_timers(int utilisation_percent);

}  // namespace hotpath
