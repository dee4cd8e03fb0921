// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bounds/exact_worst_cases.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::guarantees {

/// Writes a run folder for each worst case below FOLDER/EXECUTOR, the simulated schedule that reaches it,
/// and returns lines that name them. The folder's command repeats the run: it reads the graph, the phases and
/// the execution times from files beside the run folder. `graph` and `tasks` are those of the exploration;
/// `options` are those of the command. Throws UsageError, and RunError if a schedule misses its value.
[[nodiscard]] std::string write_witnesses(const std::vector<bounds::ReachedWorstCase>& worst_cases,
                                          const Graph& graph, const GraphTasks& tasks,
                                          const setup::ExecutorSpec& executor,
                                          const setup::CommonOptions& options,
                                          const std::filesystem::path& folder);

}  // namespace hotpath::guarantees
