// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::commands {

/// Prints published bounds for executors with several threads beside exact values and bounds of hotpath.
void judge_published_threads();

}  // namespace hotpath::commands
