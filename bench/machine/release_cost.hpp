// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// What it costs on this machine to release one timer (the paper's delta), without waking another thread.
struct ReleaseCost {
  Duration p50{}, p999{}, max{};
  std::size_t releases = 0;
  /// Length of one pass of the releaser that releases `timers` at once: the paper's k + timers * delta.
  struct Pass {
    std::uint32_t timers = 0;
    std::size_t passes = 0;
    Duration p50{}, p99{}, max{};
  };
  std::vector<Pass> passes = {};  ///< Ascending in `timers`.
};

/// Measures it on the calling thread with the paper's seven timers under `rm-ro`, simultaneous releases
/// divided by their number. Takes some tens of milliseconds.
ReleaseCost measure_release_cost();

}  // namespace hotpath
