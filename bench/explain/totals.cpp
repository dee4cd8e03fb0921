// SPDX-License-Identifier: Apache-2.0
#include "explain/totals.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath::explain {

void Totals::add(const Explanation& explanation) {
  ++outputs;
  latency += explanation.latency;
  for (const Part& part : explanation.parts) {
    causes[static_cast<std::size_t>(part.cause)] += part.length;
    if (part.behind.task != kNoTask) behind[{part.cause, part.rule, part.behind.task}] += part.length;
  }
}

const Output& at_quantile(const std::vector<Output>& by_latency, double quantile) {
  return by_latency[nearest_rank(by_latency.size(), quantile)];
}

std::vector<Output> sorted_by_latency(std::vector<Output> outputs) {
  std::ranges::stable_sort(outputs, {}, &Output::latency);
  return outputs;
}

Overview::Overview(const std::vector<Output>& outputs) {
  constexpr double kBelowMedian = 0.45, kAboveMedian = 0.55;
  const std::vector<Output> sorted = sorted_by_latency(outputs);
  middle_from_ = at_quantile(sorted, kBelowMedian).latency;
  middle_to_ = at_quantile(sorted, kAboveMedian).latency;
  const auto worst = std::max(1.0, std::floor(kTail * static_cast<double>(sorted.size())));
  tail_from_ = sorted[sorted.size() - static_cast<std::size_t>(worst)].latency;
}

void Overview::add(const Explanation& explanation) {
  all.add(explanation);
  if (explanation.latency >= middle_from_ && explanation.latency <= middle_to_) middle.add(explanation);
  if (explanation.latency >= tail_from_) tail.add(explanation);
}

}  // namespace hotpath::explain
