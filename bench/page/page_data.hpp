// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

/// What the interactive page shows of runs besides their summaries.
namespace hotpath::page {

/// The largest numbers in a page; above them, it is thinned.
inline constexpr std::size_t kMostJobs = 100'000;
inline constexpr std::size_t kMostOutputs = 5'000;
inline constexpr std::size_t kMostParts = 250'000;  ///< Of all explained outputs.

/// Jobs, explained outputs and graphs of stored runs, in their order. Reads jobs.csv several times,
/// row by row; memory does not grow with it. Throws UsageError and InputError.
[[nodiscard]] nlohmann::json page_data(const std::vector<std::string>& folders);

}  // namespace hotpath::page
