// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace hotpath {

/// Handles SIGINT and SIGTERM from now on, for an orderly end. Call it before any other thread
/// starts, so that all threads block these signals. A signal also shuts ROS down. If a ROS or DDS
/// call does not return, the process ends after 5 s; the bridge has no data to lose.
void handle_termination();

/// Waits for at most `time`; returns whether a signal has arrived, now or earlier.
bool terminated(std::chrono::milliseconds time = {});

}  // namespace hotpath
