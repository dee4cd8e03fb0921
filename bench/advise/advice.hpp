// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "setup/run_setup.hpp"

namespace hotpath::advise {

/// The command line of `hotpath advise`.
struct Options : setup::CommonOptions {
  std::string objective = "hot_path:p99";
  std::string now = "default";  ///< The system's current executor or deployment.
  std::string costs = "reference";
  std::optional<unsigned> cores;
  std::uint32_t draws = 20;
  double budget_s = 120;
  unsigned threads = 0;
};

/// Predicts the graph under every suitable executor and deployment, ranks them, repeats the ranking
/// under changed assumptions, and writes table, figure, advice and the files of the recommended
/// change. Throws UsageError, InputError, and RunError for an overloaded graph.
void advise(const Options& options);

}  // namespace hotpath::advise
