// SPDX-License-Identifier: Apache-2.0
// Replaces replay.cpp in a build without Fast DDS.
#include "program/errors.hpp"
#include "telemetry/replay.hpp"

namespace hotpath::telemetry {

void replay_run(const ReplayOptions&) {
  throw program::UsageError("replay needs Fast DDS, but this hotpath was built without it: docs/ros2.md");
}

}  // namespace hotpath::telemetry
