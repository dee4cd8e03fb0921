// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "program/json_record.hpp"

namespace hotpath::results {

/// Resource usage of a run from its first release to its stop, summed over its processes.
struct ProcessUsage {
  Duration cpu_time{};
  std::int64_t peak_memory_kib = 0;
  std::int64_t voluntary_switches = 0;
  std::int64_t involuntary_switches = 0;
  Duration stolen{};     ///< Time withheld by the hypervisor, summed over the run's CPUs.
  Duration throttled{};  ///< Time lost to a quota of CPU time or to overheating, likewise.
  Duration others{};     ///< CPU time of other processes, divided by the number of the run's CPUs.
  Duration wall{};

  /// A time in percent of the length.
  [[nodiscard]] double percent(Duration time) const {
    return 100.0 * static_cast<double>(time.count()) / static_cast<double>(wall.count());
  }
  /// Adds the usage of another run, except memory: the maximum counts.
  ProcessUsage& operator+=(const ProcessUsage& other) {
    cpu_time += other.cpu_time;
    peak_memory_kib = std::max(peak_memory_kib, other.peak_memory_kib);
    voluntary_switches += other.voluntary_switches;
    involuntary_switches += other.involuntary_switches;
    stolen += other.stolen;
    throttled += other.throttled;
    others += other.others;
    wall += other.wall;
    return *this;
  }
};

/// What disturbed a repetition with this usage, by the counters of the kernel: a phrase for each of
/// `stolen`, `throttled` and `others` that exceeds its limit. A disturbed repetition is marked and
/// counts like any other.
[[nodiscard]] std::vector<std::string> disturbances(const ProcessUsage& usage);

/// Suffixes of the keys name the units.
void fields(auto& visit, program::MaybeConst<ProcessUsage> auto& part) {
  constexpr double kMost_ms = 9e8;  // ten days, so that the sum over 10000 repetitions does not overflow
  constexpr std::int64_t kMost = 1'000'000'000'000;
  visit.ms("cpu_time_ms", part.cpu_time, kMost_ms);
  visit.ms("wall_ms", part.wall, kMost_ms);
  visit("cpu_use_percent",
        part.wall > Duration() ? std::optional(part.percent(part.cpu_time)) : std::nullopt);
  visit.up_to(kMost, "peak_memory_kib", part.peak_memory_kib);
  visit.up_to(kMost, "voluntary_context_switches", part.voluntary_switches);
  visit.up_to(kMost, "involuntary_context_switches", part.involuntary_switches);
  visit.ms("stolen_ms", part.stolen, kMost_ms);
  if (!visit.has("others_ms")) return;  // of an older version
  visit.ms("throttled_ms", part.throttled, kMost_ms);
  visit.ms("others_ms", part.others, kMost_ms);
}

}  // namespace hotpath::results
