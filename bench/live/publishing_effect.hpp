// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// With `--live-alternate`, the repetitions that are published: the 2nd and 3rd of every four, so that
/// neither side gains by what drifts steadily.
constexpr bool published_by_turns(std::uint32_t repetition) {
  return repetition % 4 == 1 || repetition % 4 == 2;
}

/// What publishing does to one chain of one executor: the median hot-path latency of the repetitions that
/// were published divided by that of the others.
struct PublishingEffect {
  std::string executor, chain;
  std::size_t samples_with = 0, samples_without = 0;
  Estimate median_ratio;  ///< NaN where one side has no samples.
};

/// Of repetitions taken by turns.
std::vector<PublishingEffect> publishing_effects(const std::vector<ExecutorRuns>& runs,
                                                 const SummaryOptions& options);

/// A line for each, in percent.
void write_publishing_effects(std::ostream& out, const std::vector<PublishingEffect>& effects);
void to_json(nlohmann::json& j, const PublishingEffect& effect);

}  // namespace hotpath
