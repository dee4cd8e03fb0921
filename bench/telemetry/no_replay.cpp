// SPDX-License-Identifier: Apache-2.0
// Without Fast DDS.
#include "program/errors.hpp"
#include "telemetry/replay.hpp"

namespace hotpath {

void replay_run(const ReplayOptions&) {
  throw UsageError("replay publishes over Fast DDS, without which this hotpath was built: docs/ros2.md");
}

}  // namespace hotpath
