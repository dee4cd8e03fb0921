// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "advise/candidates.hpp"

namespace hotpath::advise {

/// Writes executor.yaml and the graph.yaml that it names into the folder: the options with which
/// hotpath_rclcpp's PriorityExecutor runs the candidate in each process. Returns the files, none for
/// wait-set executors, which are rclcpp's own, and for deployments to several executors.
/// `platform` replaces the candidate's costs in graph.yaml. `offsets`: a file of phases in the same
/// folder; empty: none.
std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets,
                                              const std::filesystem::path& folder);

}  // namespace hotpath::advise
