// SPDX-License-Identifier: Apache-2.0
#include "results/process_usage.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace hotpath {

using nlohmann::json;

ProcessUsage& ProcessUsage::operator+=(const ProcessUsage& other) {
  cpu_time += other.cpu_time;
  peak_memory_kib = std::max(peak_memory_kib, other.peak_memory_kib);
  voluntary_switches += other.voluntary_switches;
  involuntary_switches += other.involuntary_switches;
  stolen += other.stolen;
  wall += other.wall;
  return *this;
}

json to_json(const ProcessUsage& usage) {
  json cpu_use = nullptr;
  if (usage.wall.count() > 0) {
    cpu_use = 100.0 * static_cast<double>(usage.cpu_time.count()) / static_cast<double>(usage.wall.count());
  }
  return {{"cpu_time_ms", to_ms(usage.cpu_time)},
          {"wall_ms", to_ms(usage.wall)},
          {"cpu_use_percent", cpu_use},
          {"peak_memory_kib", usage.peak_memory_kib},
          {"voluntary_context_switches", usage.voluntary_switches},
          {"involuntary_context_switches", usage.involuntary_switches},
          {"stolen_ms", to_ms(usage.stolen)}};
}

ProcessUsage usage_from_json(const json& j) {
  return {.cpu_time = from_ms(j.at("cpu_time_ms").get<double>()),
          .peak_memory_kib = j.at("peak_memory_kib").get<std::int64_t>(),
          .voluntary_switches = j.at("voluntary_context_switches").get<std::int64_t>(),
          .involuntary_switches = j.at("involuntary_context_switches").get<std::int64_t>(),
          .stolen = from_ms(j.at("stolen_ms").get<double>()),
          .wall = from_ms(j.at("wall_ms").get<double>())};
}

}  // namespace hotpath
