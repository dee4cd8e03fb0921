// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath::bounds {

/// What a bound, an exact value or a prediction rests on.
struct Premise {
  std::string text;
  bool stated =
      true;  ///< The graph, its platform or an option says so; otherwise it is assumed, not measured.
};

/// The premises about a graph under an executor or deployment (in words), each in a few words.
[[nodiscard]] std::vector<Premise> premises(const Graph& graph, const TaskSet& set,
                                            const std::string& executor, bool phases_known);

/// Those that are stated, or those that are not, separated by semicolons.
[[nodiscard]] std::string list_of(const std::vector<Premise>& premises, bool stated);

}  // namespace hotpath::bounds
