// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <variant>
#include <vector>

namespace hotpath {

/// A message of a LiDAR driver.
struct LidarSample {
  std::uint32_t topic = 0;     ///< Index into the topics that were asked for.
  std::int64_t stamp_ns = 0;   ///< When it was published, nanoseconds since the Unix epoch.
  std::uint64_t sequence = 0;  ///< Publications of that driver before this one.
};

/// A sample of one of the topics of Bytes.
struct BytesSample {
  std::uint32_t topic = 0;
  std::vector<std::uint8_t> data;
};

using Event = std::variant<telemetry::RunInfo, telemetry::Statistics, telemetry::ChainSample,
                           telemetry::Clock, LidarSample, BytesSample>;
inline constexpr std::array<const char*, std::variant_size_v<Event>> kStreams = {
    "run", "statistics", "chain_samples", "clock", "points", "bytes"};

/// Memory that the event holds, with its texts and sequences.
std::size_t bytes_of(const Event& event);

/// The run of a sample; empty: it names none.
std::string_view run_of(const Event& event);

}  // namespace hotpath
