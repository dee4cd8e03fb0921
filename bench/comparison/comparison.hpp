// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hotpath::comparison {

/// What `hotpath diff` was told. Empty names: not written.
struct Options {
  std::filesystem::path old, now;
  bool gate = false;          ///< Judge whether anything became worse, instead of showing percentiles.
  bool across_loads = false;  ///< Also compare different loads.
  std::string csv = {}, output = {}, junit = {}, markdown = {};
};

/// Compares two runs, reproductions, or folders of runs (or, without `gate`, results of `hotpath bench`):
/// prints the table, and writes it as JSON and to the named files. Returns whether the gate found that
/// anything became worse. Throws UsageError and InputError for results that cannot be compared, RunError.
[[nodiscard]] bool compare(const Options& options);

}  // namespace hotpath::comparison
