// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace hotpath {

/// An element of a chain on one default executor, in the terms of Teper, Guenzel, Ueter, von der
/// Brueggen, Chen: "End-to-end timing analysis in ROS2", RTSS 2022.
struct Rtss2022Element {
  enum class Kind : std::uint8_t {
    timer,
    /// Filter, actuator, passive input, or trigger reached from the chain that publishes to it.
    subscription,
    passive_trigger,  ///< Trigger of a fusion that this chain reaches through a passive input.
  };
  Kind kind = Kind::subscription;
  /// timer: its own. passive_trigger: of x, the last timer before the trigger on its chain.
  std::int64_t period = 0;
  std::int64_t wcet = 0;  ///< timer: its own. passive_trigger: of x.
  /// passive_trigger: number of elements after x up to and including the trigger.
  std::uint32_t distance = 0;
};

/// End-to-end latency (reaction time and data age) of a chain on one default executor, in ns.
/// `total_wcet` is the sum of the WCETs of all its callbacks. Throws AnalysisError for times out of
/// range and for a timer whose execution time exceeds its period.
std::int64_t teper_2022(std::int64_t total_wcet, const std::vector<Rtss2022Element>& chain);

}  // namespace hotpath
