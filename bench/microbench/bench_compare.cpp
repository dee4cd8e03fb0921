// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_compare.hpp"

#include <algorithm>
#include <cmath>

#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath {

namespace {

/// Every repetition is one sample.
RepeatedSamples repetitions(const std::vector<double>& values) {
  std::vector<std::vector<double>> samples;
  for (const double v : values) samples.push_back({v});
  return RepeatedSamples(std::move(samples));
}

bool comparable(const std::vector<double>& values) {
  return values.size() >= kLeastRepetitions &&
         std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v) && v > 0; });
}

bool beyond_noise(const ValueComparison& c) {
  return c.verdict == Verdict::smaller || c.verdict == Verdict::larger;
}

double effect(const ValueComparison& c) { return std::abs(std::log(c.ratio.value)); }

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::within_noise:
      return "within noise";
    case Verdict::smaller:
      return "smaller";
    case Verdict::larger:
      return "larger";
    case Verdict::not_comparable:
      return "not comparable";
  }
  return "?";
}

std::vector<ValueComparison> compare_values(const BenchValues& before, const BenchValues& after,
                                            std::uint64_t seed) {
  BootstrapOptions options;
  options.confidence = kCompareConfidence;
  options.seed = seed;
  std::vector<ValueComparison> comparisons;
  for (const auto& [key, old_values] : before.values) {
    const auto found = after.values.find(key);
    if (found == after.values.end()) continue;
    ValueComparison c{key.first, key.second, kNoValue, kNoValue, {}, Verdict::not_comparable};
    const RepeatedSamples old_samples = repetitions(old_values), new_samples = repetitions(found->second);
    c.before = quantile(old_samples.pooled(), 0.5);
    c.after = quantile(new_samples.pooled(), 0.5);
    if (comparable(old_values) && comparable(found->second)) {
      c.ratio = ratio_of_quantiles(new_samples, old_samples, 0.5, options);
      c.verdict = c.ratio.interval->high < 1  ? Verdict::smaller
                  : c.ratio.interval->low > 1 ? Verdict::larger
                                              : Verdict::within_noise;
    }
    comparisons.push_back(std::move(c));
  }
  return comparisons;
}

void write_comparison(std::ostream& out, const std::vector<ValueComparison>& comparisons) {
  std::vector<ValueComparison> rows = comparisons;
  std::stable_sort(rows.begin(), rows.end(), [](const ValueComparison& a, const ValueComparison& b) {
    if (beyond_noise(a) != beyond_noise(b)) return beyond_noise(a);
    return beyond_noise(a) && effect(a) > effect(b);
  });
  TextTable table("", {"value", "before", "after", "ratio", "[99 % interval]", ""});
  for (const ValueComparison& c : rows) {
    const auto& interval = c.ratio.interval;
    table.add_row({c.benchmark + " " + c.metric, fixed(c.before, 1), fixed(c.after, 1),
                   interval ? fixed(c.ratio.value, 3) : "",
                   interval ? text("[%.3f, %.3f]", interval->low, interval->high) : "",
                   to_string(c.verdict)});
  }
  out << table << std::count_if(rows.begin(), rows.end(), beyond_noise) << " of " << rows.size()
      << " values differ beyond noise.\n";
}

}  // namespace hotpath
