// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "results/run_folder.hpp"
#include "results/stored_run.hpp"

namespace hotpath::results {

/// Copies an input of a run into its folder, as `name` or else by its kind, and notes it in `record`.
/// Throws RunError if the copy cannot be written, InputError if the input cannot be read.
void keep_input(const RunFolder& folder, RunRecord& record, const std::string& kind,
                const std::filesystem::path& original, std::string name = "");

/// The run's own copy of its input of a kind; none in runs of older versions. Warns on standard
/// error, once, if the original has changed since.
[[nodiscard]] std::optional<std::filesystem::path> kept_input(const StoredRun& run, const std::string& kind);

}  // namespace hotpath::results
