// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "properties.hpp"

namespace hotpath::test {

/// Simulates a random graph under an executor (`NAME` or `NAME:VARIANT`) with random phases and
/// execution times, and compares the observations with all of its bounds. No executor: a random
/// deployment. `also_covers`:
/// assumptions that no method checks.
CaseResult check_bounds(std::uint64_t seed, const std::string& executor, std::uint32_t also_covers = 0);

}  // namespace hotpath::test
