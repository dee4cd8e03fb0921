// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

namespace hotpath {

/// A message of a LiDAR driver.
struct LidarSample {
  std::uint32_t topic = 0;     ///< Index into the requested topics.
  std::int64_t stamp_ns = 0;   ///< Publication instant, nanoseconds since the Unix epoch.
  std::uint64_t sequence = 0;  ///< Number of earlier publications of that driver.
};

using Event = std::variant<telemetry::RunInfo, telemetry::Statistics, telemetry::ChainSample,
                           telemetry::Clock, LidarSample>;
inline constexpr std::array<const char*, std::variant_size_v<Event>> kStreams = {
    "run", "statistics", "chain_samples", "clock", "points"};

/// Memory of the event in bytes, including its texts and sequences.
std::size_t bytes_of(const Event& event);

/// The run id of a sample; empty if the sample has none.
std::string run_of(const Event& event);

}  // namespace hotpath
