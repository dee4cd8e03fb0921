// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// The clock of live runs, CLOCK_MONOTONIC.
[[nodiscard]] inline Time now() { return std::chrono::steady_clock::now(); }

/// Reads one of Linux's clocks; the time since that clock's own epoch.
[[nodiscard]] inline Duration read_clock(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::chrono::seconds(t.tv_sec) + Duration(t.tv_nsec);
}

}  // namespace hotpath
