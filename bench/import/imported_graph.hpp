// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "hotpath/reference_system/ros_names.hpp"

namespace hotpath::imports {

/// A graph made from the description of a real system, with notes for the user.
struct ImportedGraph {
  Graph graph;
  GraphComments comments;
  Deployment deployment;             ///< Its executors; none: the description names none.
  std::vector<std::string> summary;  ///< The parts that were imported, a sentence each.
  std::vector<std::string> missing;  ///< The parts that were left out or guessed, a sentence each.
};

/// A sentence with the numbers of nodes, timers, subscriptions, executors and chains.
[[nodiscard]] std::string counts_of(const ImportedGraph& imported);

/// Writes graph.yaml and, if there are executors, deployment.yaml into the new folder, and prints
/// the notes. Throws UsageError, InputError.
void write_import(ImportedGraph imported, const std::string& folder);

}  // namespace hotpath::imports
