// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "program/table.hpp"
#include "results/summary.hpp"

namespace hotpath::sweep {

/// A table row of an executor and a chain; a graph without chains has one row without a chain.
struct MeasuredRow {
  std::string executor, chain;
  std::size_t samples = 0;
  std::optional<double> hot_path_p50_ms, hot_path_p99_ms, hot_path_max_ms, end_to_end_p50_ms,
      end_to_end_max_ms;
  std::uint64_t drops = 0;  ///< Samples lost along the chain.
  // The same in all rows of the executor:
  std::uint64_t callbacks = 0, skipped = 0, overwritten = 0, deadline_overruns = 0;
  /// The largest response time of a timer divided by its deadline.
  std::optional<double> response_share_max;
  double longest_wait_ms = 0;
  std::uint64_t never_ran = 0;  ///< Tasks that had work and never ran.

  /// Timestamps and samples that no job ever used; the column `lost`.
  [[nodiscard]] std::uint64_t lost() const { return skipped + overwritten; }
};

/// Nothing for an infinite value and NaN.
[[nodiscard]] std::optional<double> finite(double value);

[[nodiscard]] std::vector<MeasuredRow> measured_rows(const results::Summary& summary);

/// The columns of the stored table, beginning with `executor`.
[[nodiscard]] const std::vector<program::Column<MeasuredRow>>& measured_columns();

}  // namespace hotpath::sweep
