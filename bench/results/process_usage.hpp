// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// What a run used from its first release to its stop, summed over its processes.
struct ProcessUsage {
  Duration cpu_time{};
  std::int64_t peak_memory_kib = 0;
  std::int64_t voluntary_switches = 0;
  std::int64_t involuntary_switches = 0;
  Duration stolen{};  ///< Time that the hypervisor gave to others, summed over the run's processors.
  Duration wall{};

  /// Adds another run's; of the memory the larger counts.
  ProcessUsage& operator+=(const ProcessUsage& other);
};

/// Units are the endings of keys. The second throws nlohmann's exceptions for what is none.
[[nodiscard]] nlohmann::json to_json(const ProcessUsage& usage);
[[nodiscard]] ProcessUsage usage_from_json(const nlohmann::json& usage);

}  // namespace hotpath
