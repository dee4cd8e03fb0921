// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/phases.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

/// What live and simulated runs are told alike on the command line.
struct CommonOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors;
  double duration_s = 30, warm_up_s = 2;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  std::optional<double> load_percent;
  std::optional<WorkMode> work;
  Phases phases = Phases::creation;
  std::string phases_file;
  std::optional<double> phase_step_ms;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  std::string output;
};

}  // namespace hotpath
