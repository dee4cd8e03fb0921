// SPDX-License-Identifier: Apache-2.0
#include "explain/totals.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath::explain {

CauseTimes causes_of(const Explanation& explanation) {
  CauseTimes times{};
  for (const Part& part : explanation.parts) times[static_cast<std::size_t>(part.cause)] += part.length;
  return times;
}

CauseSums& CauseSums::operator+=(const CauseSums& other) {
  outputs += other.outputs;
  latency += other.latency;
  for (std::size_t c = 0; c < kCauses; ++c) causes[c] += other.causes[c];
  return *this;
}

double Totals::mean_ms(Duration sum, std::uint64_t count) {
  return count == 0 ? 0 : to_ms(sum) / static_cast<double>(count);
}

double Totals::mean_ms(const Behind& key) const {
  const auto sum = behind.find(key);
  return sum == behind.end() ? 0 : mean_ms(sum->second, waits);
}

void Totals::add(const Explanation& explanation) {
  *this += {1, explanation.latency, causes_of(explanation)};
  ++waits;
  for (const Part& part : explanation.parts) {
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

void ComparedOutputs::add(const Explanation& e) {
  totals.add(e);
  if (!e.complete) return;
  const JobRef source = e.path.front().job.ref();
  by_source.insert({{e.repetition, source.task, source.sequence}, {1, e.latency, causes_of(e)}});
}

Comparison compare(const ComparedOutputs& a, const ComparedOutputs& b, bool pairs) {
  const auto shared = [](const auto& of, const auto& others) {
    CauseSums sums;
    for (const auto& [source, output] : of) {
      if (others.contains(source)) sums += output;
    }
    return sums;
  };
  Comparison comparison{a.totals, b.totals};
  const CauseSums of_a = shared(a.by_source, b.by_source), of_b = shared(b.by_source, a.by_source);
  comparison.paired = pairs && of_a.outputs == of_b.outputs &&
                      2 * of_a.outputs > std::max(a.totals.outputs, b.totals.outputs);
  if (!comparison.paired) return comparison;
  static_cast<CauseSums&>(comparison.a) = of_a;
  static_cast<CauseSums&>(comparison.b) = of_b;
  return comparison;
}

}  // namespace hotpath::explain
