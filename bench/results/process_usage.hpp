// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "program/json_fields.hpp"

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

/// Suffixes of the keys name the units. from_json() throws nlohmann's exceptions or
/// std::out_of_range for invalid input.
inline void to_json(nlohmann::json& j, const ProcessUsage& usage) {
  j = {{"cpu_time_ms", to_ms(usage.cpu_time)},
       {"wall_ms", to_ms(usage.wall)},
       {"cpu_use_percent", nullptr},
       {"peak_memory_kib", usage.peak_memory_kib},
       {"voluntary_context_switches", usage.voluntary_switches},
       {"involuntary_context_switches", usage.involuntary_switches},
       {"stolen_ms", to_ms(usage.stolen)},
       {"throttled_ms", to_ms(usage.throttled)},
       {"others_ms", to_ms(usage.others)}};
  if (usage.wall > Duration()) j["cpu_use_percent"] = usage.percent(usage.cpu_time);
}
inline void from_json(const nlohmann::json& j, ProcessUsage& usage) {
  // Ten days, so that the sum over 10000 repetitions does not overflow.
  const auto ms = [&](const char* key) { return from_ms(program::number_up_to(9e8, j, key)); };
  const auto count = [&](const char* key) {
    return program::number_up_to<std::int64_t>(1'000'000'000'000, j, key);
  };
  usage = {.cpu_time = ms("cpu_time_ms"),
           .peak_memory_kib = count("peak_memory_kib"),
           .voluntary_switches = count("voluntary_context_switches"),
           .involuntary_switches = count("involuntary_context_switches"),
           .stolen = ms("stolen_ms"),
           .wall = ms("wall_ms")};
  if (!j.contains("others_ms")) return;  // of an older version
  usage.throttled = ms("throttled_ms");
  usage.others = ms("others_ms");
}

}  // namespace hotpath::results
