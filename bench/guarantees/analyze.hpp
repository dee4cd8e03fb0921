// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "guarantees/bound_rows.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::guarantees {

/// A graph or a stored run, the phases for which its bounds hold, and where they go.
struct AnalyzeOptions : setup::CommonOptions, setup::PlatformOptions {
  std::string trace, csv, witness;
  bool known_phases = false;  ///< Bounds hold for the phases of these options only.
  std::optional<double> phase_uncertainty_us;
  bool strict = false, exact = false;
};

/// Bounds the worst cases of every executor of `options`, prints them to `out` and writes the files
/// that the options name. Returns the rows of all methods. Throws UsageError and
/// InputError, and RunError if a bound is violated.
std::vector<BoundRow> analyze(const AnalyzeOptions& options, std::ostream& out);

}  // namespace hotpath::guarantees
