// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "import/caret_files.hpp"
#include "import/imported_graph.hpp"

namespace hotpath {

/// Adds CARET's named paths as chains to the graph; `missing` explains why a path is not a chain.
void add_chains(const CaretArchitecture& architecture, ImportedGraph& imported);

/// CARET's executors with tasks; executor `external` has all other tasks. `task_of`: by callback.
[[nodiscard]] Deployment deployment_of(const CaretArchitecture& architecture,
                                       const std::map<std::string, std::string>& task_of,
                                       const GraphTasks& tasks);

}  // namespace hotpath
