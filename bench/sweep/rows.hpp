// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "program/table.hpp"
#include "results/summary.hpp"

namespace hotpath::sweep {

/// A table row of an executor and a chain, which the summary holds. nullptr: the graph has no chains.
struct MeasuredRow {
  const results::ExecutorSummary* executor;
  const results::ChainSummary* chain;

  /// The largest response time of a timer divided by its deadline.
  [[nodiscard]] std::optional<double> response_share_max() const;
};

/// Nothing for an infinite value and NaN.
[[nodiscard]] std::optional<double> finite(double value);

/// The rows that a sweep stores of each executor, with columns that begin with `executor`.
[[nodiscard]] program::Table measured_table(const results::Summary& summary);

}  // namespace hotpath::sweep
