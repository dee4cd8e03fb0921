// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "import/caret_files.hpp"
#include "import/imported_graph.hpp"

namespace hotpath {

/// Adds CARET's named paths as chains to the graph; of those that are none, `missing` says why.
void add_chains(const CaretArchitecture& architecture, ImportedGraph& imported);

/// CARET's executors that have tasks; one called `external` has those of no executor. `task_of`: by callback.
[[nodiscard]] Deployment deployment_of(const CaretArchitecture& architecture,
                                       const std::map<std::string, std::string>& task_of,
                                       const GraphTasks& tasks);

}  // namespace hotpath
