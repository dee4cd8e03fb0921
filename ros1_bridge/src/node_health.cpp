// SPDX-License-Identifier: Apache-2.0
#include "node_health.hpp"

#include <algorithm>

#include "text.hpp"

namespace hotpath {

using diagnostic_msgs::DiagnosticStatus;

void add_value(DiagnosticStatus& status, const std::string& key, const std::string& value) {
  status.values.emplace_back();
  status.values.back().key = key;
  status.values.back().value = value;
}

DiagnosticStatus node_health(const std::string& name, const telemetry::NodeStatistics& before,
                             const telemetry::NodeStatistics& now, double seconds) {
  DiagnosticStatus health;
  health.name = name;
  const auto judge = [&](const char* what, double value, double warn, double error) {
    if (value < warn) return;
    const std::int8_t level = value >= error ? DiagnosticStatus::ERROR : DiagnosticStatus::WARN;
    health.level = std::max(health.level, level);
    health.message += (health.message.empty() ? "" : ", ") + decimals(value, 1) + " " + what;
  };
  const auto rate = [&](std::uint64_t then, std::uint64_t later) {
    return seconds > 0 && later > then ? static_cast<double>(later - then) / seconds : 0.0;
  };
  judge("skipped jobs per second", rate(before.skipped(), now.skipped()), 1, 5);
  judge("overwritten samples per second", rate(before.overwritten(), now.overwritten()), 1, 5);
  judge("deadline overruns per second", rate(before.overruns(), now.overruns()), 1, 5);
  judge("jobs in the queue", now.queued(), 5, 20);
  if (health.message.empty()) health.message = "OK";

  add_value(health, "ran", std::to_string(now.ran()));
  add_value(health, "skipped", std::to_string(now.skipped()));
  add_value(health, "overwritten", std::to_string(now.overwritten()));
  add_value(health, "deadline overruns", std::to_string(now.overruns()));
  add_value(health, "queue", std::to_string(now.queued()));
  add_value(health, "utilization", decimals(now.utilization(), 3));
  add_value(health, "response time median ms", milliseconds(now.response_median_ns(), 3));
  add_value(health, "response time p99 ms", milliseconds(now.response_p99_ns(), 3));
  add_value(health, "response time max ms", milliseconds(now.response_max_ns(), 3));
  return health;
}

}  // namespace hotpath
