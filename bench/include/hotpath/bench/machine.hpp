// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace hotpath {

/// What decides about a result on this machine; stored with every result.
struct Machine {
  std::string cpu_model, kernel, distribution, governor, hypervisor, compiler, build_type;
  int processors = 0;
  bool preempt_rt = false;
  long rt_runtime_us = -1;  ///< Real-time throttling: share of rt_period_us; -1: off or unknown.
  long rt_period_us = 0;
  double load_average = 0;  ///< Over the last minute, when it was read.
};

Machine read_machine();
nlohmann::json to_json(const Machine& machine);

/// Whole sentences about what may disturb a measurement.
std::vector<std::string> warnings(const Machine& machine);

}  // namespace hotpath
