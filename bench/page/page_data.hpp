// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

/// What the interactive page shows of runs besides their summaries.
namespace hotpath::page {

/// Jobs, explained outputs and graphs of stored runs, in their order. Reads jobs.csv several times,
/// row by row; memory does not grow with it. Throws UsageError and InputError.
[[nodiscard]] nlohmann::json page_data(const std::vector<std::string>& folders);

}  // namespace hotpath::page
