// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "machine/machine_noise.hpp"

namespace hotpath {

/// What decides about a result on this machine; stored with every result.
struct Machine {
  std::string cpu_model, kernel, distribution, governor, hypervisor, compiler, build_type;
  int processors = 0;
  bool preempt_rt = false;
  long rt_runtime_us = -1;  ///< Real-time throttling: share of rt_period_us; -1: off or unknown.
  long rt_period_us = 0;
  double load_average = 0;  ///< Over the last minute, when it was read.
  std::string turbo;        ///< `on`, `off`, or `unknown`.
  std::string clock_source;
  long timer_slack_ns = 0;    ///< Of a new thread under the ordinary policy.
  double stolen_percent = 0;  ///< Of all processors' time since boot, taken by the hypervisor.
  std::vector<std::string> real_time_threads;  ///< Of other programs: `name (fifo:50)`.
  MachineNoise noise;
};

/// How long read_machine() watches the cores for a result folder.
inline constexpr Duration kBriefNoise = std::chrono::milliseconds(200);

Machine read_machine(Duration watch = kBriefNoise);
nlohmann::json to_json(const Machine& machine);

/// Whole sentences about what may disturb a measurement.
std::vector<std::string> warnings(const Machine& machine);

}  // namespace hotpath
