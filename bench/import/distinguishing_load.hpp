// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath::imports {

/// Where executors that a recording cannot tell apart run the same graph in different orders.
struct DistinguishingLoad {
  double recorded_percent = 0;  ///< Work of the graph at its execution times, in percent of its threads.
  /// The smallest tried load at which the orders of jobs of some executors differ; none: at no load.
  std::optional<double> percent;
  std::string first;  ///< The executor with which the others are compared.
  std::size_t others = 0, differing = 0;

  /// Empty if there is nothing to compare.
  [[nodiscard]] std::string sentence() const;
};

/// Simulates the graph under each of the executors (labels of the command line) with longer and
/// longer execution times. `threads` is the number of threads of the recording. Executors that need
/// numbers which the graph lacks are left out.
[[nodiscard]] DistinguishingLoad distinguishing_load(const Graph& graph, const GraphTasks& tasks,
                                                     std::span<const std::string> executors,
                                                     std::size_t threads);

}  // namespace hotpath::imports
