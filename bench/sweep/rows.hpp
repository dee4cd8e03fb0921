// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "program/table.hpp"
#include "results/summary.hpp"

namespace hotpath::sweep {

/// The largest response time of a timer divided by its deadline; none: no timer ran.
[[nodiscard]] std::optional<double> response_share_max(const results::ExecutorSummary& executor);

/// Nothing for an infinite value and NaN.
[[nodiscard]] std::optional<double> finite(double value);

/// The rows that a sweep stores of each executor and chain, with columns that begin with `executor`. An
/// executor of a graph without chains has one row.
[[nodiscard]] program::Table measured_table(const results::Summary& summary);

}  // namespace hotpath::sweep
