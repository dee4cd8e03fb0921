// SPDX-License-Identifier: Apache-2.0
#include "explain/totals.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath::explain {

namespace {

void add(CauseTimes& sums, const CauseTimes& times) {
  for (std::size_t c = 0; c < kCauses; ++c) sums[c] += times[c];
}

auto key(const Compared& c) { return std::tuple(c.repetition, c.source.task, c.source.sequence); }

/// The outputs of `of` that share their source job with one of `others`.
Totals sum_of_shared(const std::vector<Compared>& of, const std::vector<Compared>& others) {
  Totals totals;
  for (const Compared& c : of) {
    if (!std::ranges::binary_search(others, key(c), {}, key)) continue;
    ++totals.outputs;
    totals.latency += c.latency;
    add(totals.causes, c.causes);
  }
  return totals;
}

}  // namespace

CauseTimes causes_of(const Explanation& explanation) {
  CauseTimes times{};
  for (const Part& part : explanation.parts) times[static_cast<std::size_t>(part.cause)] += part.length;
  return times;
}

double Totals::mean_ms(Duration sum) const {
  return outputs == 0 ? 0 : to_ms(sum) / static_cast<double>(outputs);
}

double Totals::mean_ms(const Behind& key) const {
  const auto sum = behind.find(key);
  return sum == behind.end() ? 0 : to_ms(sum->second) / static_cast<double>(waits);
}

void Totals::add(const Explanation& explanation) {
  ++outputs;
  ++waits;
  latency += explanation.latency;
  explain::add(causes, causes_of(explanation));
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
  const auto count = static_cast<double>(sorted.size());
  const auto worst = static_cast<std::size_t>(std::max(1.0, std::floor(kTail * count)));
  tail_from_ = sorted[sorted.size() - worst].latency;
}

void Overview::add(const Explanation& explanation) {
  all.add(explanation);
  if (explanation.latency >= middle_from_ && explanation.latency <= middle_to_) middle.add(explanation);
  if (explanation.latency >= tail_from_) tail.add(explanation);
}

void ComparedOutputs::add(const Explanation& e) {
  totals.add(e);
  if (e.complete) outputs.push_back({e.repetition, e.path.front().job.ref(), e.latency, causes_of(e)});
}

Comparison compare(ComparedOutputs a, ComparedOutputs b, bool pairs) {
  std::ranges::sort(a.outputs, {}, key);
  std::ranges::sort(b.outputs, {}, key);
  Comparison comparison{sum_of_shared(a.outputs, b.outputs), sum_of_shared(b.outputs, a.outputs)};
  comparison.paired = pairs && comparison.a.outputs == comparison.b.outputs &&
                      2 * comparison.a.outputs > std::max(a.totals.outputs, b.totals.outputs);
  if (!comparison.paired) return {a.totals, b.totals, false};
  const auto keep_waits = [](Totals& pairs_only, const Totals& all) {
    pairs_only.behind = all.behind;
    pairs_only.waits = all.waits;
  };
  keep_waits(comparison.a, a.totals);
  keep_waits(comparison.b, b.totals);
  return comparison;
}

}  // namespace hotpath::explain
