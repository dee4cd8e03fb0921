// SPDX-License-Identifier: Apache-2.0
#include "node_health.hpp"

#include <algorithm>
#include <array>

#include "text.hpp"

namespace hotpath {

Diagnosis node_health(const std::string& name, const telemetry::NodeStatistics& before,
                      const telemetry::NodeStatistics& now, double seconds, const HealthLimits& limits) {
  const auto rate = [&](std::uint64_t then, std::uint64_t later) {
    return seconds > 0 && later > then ? static_cast<double>(later - then) / seconds : 0.0;
  };
  struct Finding {
    const char* what;
    double value;
    Limit limit;
  };
  const std::array<Finding, 4> findings = {{
      {"skipped jobs per second", rate(before.skipped(), now.skipped()), limits.skipped},
      {"overwritten samples per second", rate(before.overwritten(), now.overwritten()), limits.overwritten},
      {"deadline overruns per second", rate(before.overruns(), now.overruns()), limits.overruns},
      {"jobs in the queue", static_cast<double>(now.queued()), limits.queue},
  }};

  Diagnosis diagnosis;
  diagnosis.name = name;
  for (const Finding& finding : findings) {
    using Level = Diagnosis::Level;
    const Level level = finding.value >= finding.limit.error  ? Level::error
                        : finding.value >= finding.limit.warn ? Level::warn
                                                              : Level::ok;
    diagnosis.level = std::max(diagnosis.level, level);
    if (level == Level::ok) continue;
    if (!diagnosis.message.empty()) diagnosis.message += ", ";
    diagnosis.message += decimals(finding.value, 1) + " " + finding.what;
  }
  if (diagnosis.message.empty()) diagnosis.message = "OK";
  diagnosis.values = {
      {"ran", std::to_string(now.ran())},
      {"skipped", std::to_string(now.skipped())},
      {"overwritten", std::to_string(now.overwritten())},
      {"deadline overruns", std::to_string(now.overruns())},
      {"queue", std::to_string(now.queued())},
      {"utilization", decimals(now.utilization(), 3)},
      {"response time median ms", milliseconds(now.response_median_ns(), 3)},
      {"response time p99 ms", milliseconds(now.response_p99_ns(), 3)},
      {"response time max ms", milliseconds(now.response_max_ns(), 3)},
  };
  return diagnosis;
}

}  // namespace hotpath
