// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "setup/run_setup.hpp"

namespace hotpath {

/// What `hotpath advise` is told on the command line.
struct AdviseOptions : CommonOptions {
  std::string objective = "hot_path:p99";
  std::string now = "default";  ///< What the system has today.
  std::string costs = "reference";
  std::optional<unsigned> cores;
  std::uint32_t draws = 20;
  double budget_s = 120;
  unsigned threads = 0;
};

/// Predicts what every suitable executor and deployment would make of the graph, ranks them, doubts the
/// ranking, and writes table, figure, advice and the change that it asks for. Throws UsageError, InputError,
/// and RunError for a graph that has more work than there are cores.
void advise(const AdviseOptions& options);

}  // namespace hotpath
