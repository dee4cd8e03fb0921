// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "hotpath/analysis/periodic_task.hpp"

namespace hotpath {

/// The paper's task sets of Section VII-A: IMU, four cameras, two LiDARs, in priority order under RM.
PeriodicTasks paper_timers_only(int utilisation_percent);

/// One column of Table I: analytical worst-case response times under the RM events executor. Nanoseconds.
struct WcrtColumn {
  int utilisation_percent = 0;
  // std::nullopt: no bound within the deadline.
  std::optional<std::int64_t> imu = {};
  std::optional<std::int64_t> camera = {};
  std::optional<std::int64_t> lidar = {};
  std::array<double, 3> printed_ms{};  ///< Values printed in the paper: IMU, camera, LiDAR.
};

/// Table I for a release overhead of `delta` ns: Equation (3), then Theorem 1. The printed table
/// corresponds to delta = 0.119 ms, which the paper's text rounds to 0.12 ms.
std::array<WcrtColumn, 3> wcrt_table(std::int64_t delta);

inline constexpr std::int64_t kPaperDelta = 119'000;

}  // namespace hotpath
