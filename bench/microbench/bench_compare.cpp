// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_compare.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <tuple>

namespace hotpath {

namespace {

/// Every repetition is one sample of its own.
RepeatedSamples repetitions(const std::vector<double>& values) {
  std::vector<std::vector<double>> samples;
  for (const double v : values) samples.push_back({v});
  return RepeatedSamples(std::move(samples));
}

bool comparable(const std::vector<double>& values) {
  return values.size() >= kLeastRepetitions &&
         std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v) && v > 0; });
}

bool beyond_noise(const FigureComparison& c) {
  return c.verdict == Verdict::smaller || c.verdict == Verdict::larger;
}

double effect(const FigureComparison& c) { return std::abs(std::log(c.ratio.value)); }

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

std::vector<FigureComparison> compare_figures(const BenchFigures& before, const BenchFigures& after,
                                              std::uint64_t seed) {
  BootstrapOptions options;
  options.confidence = kCompareConfidence;
  options.seed = seed;
  std::vector<FigureComparison> comparisons;
  for (const auto& [key, old_values] : before.values) {
    const auto found = after.values.find(key);
    if (found == after.values.end()) continue;
    FigureComparison c{key.first, key.second, kNoValue, kNoValue, {}, Verdict::not_comparable};
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

void write_comparison(std::ostream& out, const std::vector<FigureComparison>& comparisons) {
  std::vector<FigureComparison> rows = comparisons;
  std::stable_sort(rows.begin(), rows.end(), [](const FigureComparison& a, const FigureComparison& b) {
    if (beyond_noise(a) != beyond_noise(b)) return beyond_noise(a);
    return beyond_noise(a) && effect(a) > effect(b);
  });
  std::size_t width = 0;
  for (const FigureComparison& c : rows) width = std::max(width, c.benchmark.size() + 1 + c.metric.size());
  const auto columns = out.flags();
  out << std::left << std::setw(static_cast<int>(width)) << "figure" << std::right << std::setw(14)
      << "before" << std::setw(14) << "after"
      << "   ratio  [99 % interval]\n";
  for (const FigureComparison& c : rows) {
    out << std::left << std::setw(static_cast<int>(width)) << (c.benchmark + " " + c.metric) << std::right
        << std::fixed << std::setprecision(1) << std::setw(14) << c.before << std::setw(14) << c.after;
    if (c.ratio.interval) {
      out << std::setprecision(3) << std::setw(8) << c.ratio.value << "  [" << c.ratio.interval->low << ", "
          << c.ratio.interval->high << "]";
    }
    out << "  " << to_string(c.verdict) << "\n";
  }
  const auto changed = std::count_if(rows.begin(), rows.end(), beyond_noise);
  out << changed << " of " << rows.size() << " figures differ beyond noise.\n";
  out.flags(columns);
}

}  // namespace hotpath
