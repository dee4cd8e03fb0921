// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "import/caret_files.hpp"
#include "import/imported_graph.hpp"

namespace hotpath::imports {

/// The command line of `hotpath import caret`.
struct CaretOptions {
  std::string file;    ///< architecture.yaml.
  std::string stats;   ///< Folder of stats_node files; empty: frequencies and execution times are unknown.
  std::string output;  ///< New folder.
  unsigned cores = 0;  ///< Processors of the recorded machine; 0: unknown.
};

/// Throws InputError with file and line if the files are not CARET's.
void import_caret(const CaretOptions& options);

/// The graph that CARET recorded. `stats` may be empty. If CARET does not name the callback that
/// publishes a topic with subscribers, it is guessed: the callback whose frequency fits the
/// subscribers best; among equals a callback on a named path, then the one with the longest
/// execution time. A topic without any known publisher gets a timer of node `external` at the
/// measured frequency.
[[nodiscard]] ImportedGraph graph_of(const CaretArchitecture& architecture,
                                     const std::map<std::string, CaretStats>& stats);

/// Adds CARET's named paths as chains to the graph; `missing` explains why a path is not a chain.
void add_chains(const CaretArchitecture& architecture, ImportedGraph& imported);

/// CARET's executors with tasks; executor `external` has all other tasks. `task_of`: by callback.
[[nodiscard]] Deployment deployment_of(const CaretArchitecture& architecture,
                                       const std::map<std::string, std::string>& task_of,
                                       const GraphTasks& tasks);

}  // namespace hotpath::imports
