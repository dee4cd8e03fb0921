// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hotpath {

/// What `hotpath import irobot` is told on the command line.
struct ImportIrobotOptions {
  std::string file;    ///< A topology of irobot-ros/ros2-performance.
  std::string output;  ///< New folder.
};

/// Throws InputError with file and line for what is no such topology.
void import_irobot(const ImportIrobotOptions& options);

}  // namespace hotpath
