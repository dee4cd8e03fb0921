// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/graph_bounds.hpp"

namespace hotpath::bounds {

/// The smallest bound that a method gives.
struct Guarantee {
  std::int64_t ns = 0;
  std::string method;
};

struct ChainGuarantee {
  std::string name;
  std::optional<Guarantee> age;       ///< End-to-end latency.
  std::optional<Guarantee> hot_path;  ///< Hot-path latency.
};

/// What theory guarantees for a graph under one executor with any phases.
struct Guarantees {
  std::vector<std::optional<Guarantee>> tasks;  ///< Response times, by task.
  std::vector<ChainGuarantee> chains;           ///< Those that begin in timers.

  /// nullptr: the chain does not begin in timers.
  [[nodiscard]] const ChainGuarantee* chain(const std::string& name) const;
};

/// The smallest of the bounds of all methods; std::nullopt if no method covers the system.
[[nodiscard]] std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                                    const std::vector<GraphBounds>& all_bounds);

}  // namespace hotpath::bounds
