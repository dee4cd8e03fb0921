// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "explain/explain.hpp"

namespace hotpath::page {

/// The outputs that a page lists: all, or `most` of them: the worst half, and evenly distributed
/// others. In the order of `outputs`.
[[nodiscard]] std::vector<explain::Output> listed(const std::vector<explain::Output>& outputs,
                                                  std::size_t most);

/// The explained outputs of one chain, or jobs of one task, the worst first. All have the sums of their
/// causes, and the worst, which together have at most `most_parts` parts, also these.
[[nodiscard]] nlohmann::json outputs_json(std::vector<explain::Explanation>& explained,
                                          std::size_t most_parts);

}  // namespace hotpath::page
