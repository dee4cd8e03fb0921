// SPDX-License-Identifier: Apache-2.0
// Replaces replay.cpp in a build without Fast DDS.
#include "program/errors.hpp"
#include "telemetry/replay.hpp"

namespace hotpath {

void replay_run(const ReplayOptions&) {
  throw UsageError("replay needs Fast DDS, but this hotpath was built without it: docs/ros2.md");
}

}  // namespace hotpath
