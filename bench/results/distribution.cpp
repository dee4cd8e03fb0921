// SPDX-License-Identifier: Apache-2.0
#include "results/distribution.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace hotpath::results {

namespace {

constexpr std::size_t kBlocks = 20, kLeastForBlocks = 4 * kBlocks;
constexpr int kPointsOfDecade = 20;  // of the logarithmic tail of a distribution

double rounded(double value, double digits) { return std::nearbyint(value * digits) / digits; }

/// Where a distribution of `n` samples is drawn: evenly up to 0.9, then evenly on the logarithmic axis up
/// to the last probability that `n` samples resolve, and 1.
std::vector<double> probabilities(std::size_t n) {
  std::vector<double> found;
  for (int k = 0; k <= 45; ++k) found.push_back(k / 50.0);
  const double decades = std::max(0.0, std::log10(static_cast<double>(n)) - 1);
  for (int k = 1; k <= static_cast<int>(decades * kPointsOfDecade); ++k)
    found.push_back(rounded(1 - 0.1 * std::pow(10.0, -static_cast<double>(k) / kPointsOfDecade), 1e12));
  found.push_back(1);
  return found;
}

}  // namespace

RepeatedSamples resampled(std::vector<std::vector<double>> repetitions, bool exact) {
  if (repetitions.size() != 1 || exact || repetitions[0].size() < kLeastForBlocks)
    return RepeatedSamples(std::move(repetitions));
  std::vector<std::vector<double>> blocks;
  const std::size_t size = repetitions[0].size();
  for (auto begin = repetitions[0].begin(); blocks.size() < kBlocks;) {
    const auto end = begin + static_cast<std::ptrdiff_t>(size / kBlocks + (blocks.size() < size % kBlocks));
    blocks.emplace_back(std::exchange(begin, end), end);
  }
  return RepeatedSamples(std::move(blocks));
}

nlohmann::json curve_of(const RepeatedSamples& samples) {
  const std::vector<double> q = probabilities(samples.pooled().size());
  nlohmann::json curve = {{"n", samples.pooled().size()}, {"q", q}};
  for (const Estimate& e : estimate_quantiles(samples, q)) {
    curve["value"].push_back(rounded(e.value, 1e6));
    curve["low"].push_back(e.interval ? nlohmann::json(rounded(e.interval->low, 1e6)) : nlohmann::json());
    curve["high"].push_back(e.interval ? nlohmann::json(rounded(e.interval->high, 1e6)) : nlohmann::json());
  }
  return curve;
}

}  // namespace hotpath::results
