// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath::advise {

/// Stores the first draw of a candidate in `folder`: graph.yaml with the candidate's costs and priorities,
/// deployment.yaml for a deployment, and run/, the run of `hotpath simulate` that repeats the draw. Returns
/// the executor's label in the run. Throws RunError, UsageError, and OverloadError if the candidate cannot
/// keep up.
std::string store_first_draw(const Candidate& candidate, const setup::CommonOptions& options,
                             const std::filesystem::path& folder);

/// Writes the latencies of one chain in all draws, in the format of chains.csv.
void write_latencies(const std::filesystem::path& file, const std::vector<const Prediction*>& predictions,
                     std::size_t chain);

}  // namespace hotpath::advise
