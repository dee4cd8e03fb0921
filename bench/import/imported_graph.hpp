// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "hotpath/reference_system/ros_names.hpp"

namespace hotpath {

/// A graph that was made from the description of a real system, and what is to be said of it.
struct ImportedGraph {
  Graph graph;
  GraphComments comments;
  Deployment deployment;             ///< Its executors; none: the description names none.
  std::vector<std::string> found;    ///< What was understood, a sentence each.
  std::vector<std::string> missing;  ///< What was left out or guessed, a sentence each.
};

/// How many nodes, timers, subscriptions, executors and chains it has.
[[nodiscard]] std::string counts_of(const ImportedGraph& imported);

/// Writes graph.yaml and, where there are executors, deployment.yaml into the new folder, and says on
/// standard output what was understood and what not. Throws UsageError, InputError.
void write_import(ImportedGraph imported, const std::string& folder);

}  // namespace hotpath
