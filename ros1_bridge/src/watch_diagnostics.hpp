// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace hotpath {

/// Publishes the lines of `hotpath watch --json` that come from a descriptor on /diagnostics, until
/// they end or `goes_on` returns false. Needs a RosNode. Throws NoReport.
void publish_watch(int descriptor, const std::function<bool()>& goes_on);

}  // namespace hotpath
