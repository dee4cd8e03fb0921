// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/time.hpp"

namespace hotpath {

/// The clock of live runs, CLOCK_MONOTONIC.
[[nodiscard]] inline Time now() { return std::chrono::steady_clock::now(); }

}  // namespace hotpath
