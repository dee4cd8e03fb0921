// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "watch_statuses.hpp"

namespace hotpath {

/// Reads the lines of `hotpath watch --json` from a descriptor, and publishes the statuses of each.
/// Without a line for three seconds, it publishes stale ones, once a second; at the end of the input
/// once. Returns at that end, or, within a second, if `goes_on` returns false. Throws NoReport.
void relay_watch(int descriptor, const std::function<bool()>& goes_on,
                 const std::function<void(const std::vector<WatchStatus>&)>& publish);

}  // namespace hotpath
