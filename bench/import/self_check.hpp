// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "setup/executor_spec.hpp"
#include "validation/validation.hpp"

namespace hotpath::imports {

enum class Light : std::uint8_t { green, yellow, red };
constexpr auto enum_texts(Light) { return texts_in_order<Light>({"green", "yellow", "red"}); }

/// A recorded system compared with the simulation of its graph under the recorded conditions.
struct SelfCheck {
  struct ChainCheck {
    std::string chain;
    validation::LatencyQuantiles recorded_ms, simulated_ms;
    double median_error_percent = kNoValue, p99_error_percent = kNoValue;  ///< Simulated to recorded.
    /// The medians differ, but each is among the outputs around the other.
    bool between_modes = false;
  };
  validation::ScheduleComparison schedule;
  std::vector<ChainCheck> chains;
  /// Skipped or overwritten timestamps and samples, of all tasks together.
  double lost_recorded_percent = 0, lost_simulated_percent = 0;
  Light light = Light::green;
  std::vector<std::string> reasons;  ///< Sentences that explain why the light is not green.
  Trace simulated;
  std::string failure;  ///< Why there is no simulation; empty: there is one.

  /// The reproduction is not green.
  void doubt(std::string reason, Light is = Light::yellow) {
    light = std::max(light, is);
    reasons.push_back(std::move(reason));
  }
};

HOTPATH_FIELDS(SelfCheck::ChainCheck, chain, recorded_ms, simulated_ms, median_error_percent,
               p99_error_percent, between_modes);

/// Limits of green: the bar for a good prediction.
inline constexpr double kMedianError_percent = 3, kP99Error_percent = 8, kLossError_points = 1,
                        kSimilarity = 0.8;

/// `recorded` is relative to its epoch and `tasks` have its phases. The simulation begins with the recorded
/// executors; jobs and outputs whose timestamp lies before the epoch do not count. `doubted`: by chain, why
/// it cannot be compared.
[[nodiscard]] SelfCheck self_check(const Graph& graph, const GraphTasks& tasks,
                                   const setup::ExecutorSpec& executor, const Trace& recorded,
                                   const std::map<std::string, std::string>& doubted = {});

}  // namespace hotpath::imports
