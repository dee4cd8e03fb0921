// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath::live {

/// The repetitions that `--live-alternate` publishes: the 2nd and 3rd of every four, so that a
/// steady drift affects both sides equally.
constexpr bool published_by_turns(std::uint32_t repetition) {
  return repetition % 4 == 1 || repetition % 4 == 2;
}

/// The effect of publishing on one chain of one executor: the median hot-path latency of the
/// published repetitions divided by the median of the others.
struct PublishingEffect {
  std::string executor, chain;
  std::size_t samples_with = 0, samples_without = 0;
  Estimate median_ratio;  ///< NaN where one side has no samples.
};

/// For repetitions that were published in turns.
std::vector<PublishingEffect> publishing_effects(const std::vector<results::ExecutorRuns>& runs,
                                                 const results::SummaryOptions& options);

/// Writes a line for each effect, in percent.
void write_publishing_effects(std::ostream& out, const std::vector<PublishingEffect>& effects);
void to_json(nlohmann::json& j, const PublishingEffect& effect);

}  // namespace hotpath::live
