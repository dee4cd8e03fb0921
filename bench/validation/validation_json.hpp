// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "validation/autoware_validation.hpp"
#include "validation/golden_validation.hpp"
#include "validation/run_validation.hpp"
#include "validation/timers_only_validation.hpp"

namespace hotpath {

/// Everything that `hotpath validate` finds out.
struct Validation {
  std::vector<GoldenValidation> golden;
  std::vector<TimersOnlyValidation> timers_only;
  std::vector<AutowareValidation> autoware;
  std::vector<RunValidation> runs;
};

/// As in validation.json. Units are the endings of keys.
nlohmann::json to_json(const Validation& validation);

}  // namespace hotpath
