// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace hotpath {

/// Element of a chain on one default executor, in the words of Teper, Guenzel, Ueter, von der Brueggen, Chen:
/// "End-to-end timing analysis in ROS2", RTSS 2022.
struct Rtss2022Element {
  enum class Kind : std::uint8_t {
    timer,
    subscription,  ///< Filter, actuator, passive input, or trigger reached from the chain that publishes to
                   ///< it.
    passive_trigger,  ///< Trigger of a fusion that this chain reaches through a passive input.
  };
  Kind kind = Kind::subscription;
  std::int64_t period =
      0;  ///< timer: its own. passive_trigger: of x, the last timer before the trigger on its chain.
  std::int64_t wcet = 0;  ///< timer: its own. passive_trigger: of x.
  std::uint32_t distance =
      0;  ///< passive_trigger: number of elements behind x up to the trigger, itself included.
};

/// End-to-end latency (reaction time and data age) of a chain on one default executor whose callbacks need
/// `total_wcet` together. Nanoseconds. Throws AnalysisError for times out of range and for a
/// timer whose execution time exceeds its period.
std::int64_t teper_2022(std::int64_t total_wcet, const std::vector<Rtss2022Element>& chain);

}  // namespace hotpath
