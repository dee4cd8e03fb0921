// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/waters_statistics.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath {

namespace {

constexpr double kZ = 1.959963984540054;  // 97.5 % of the normal distribution

/// Reductions in percent, with the limits of each task set's chains.
struct Clustered {
  std::vector<double> value;
  std::vector<std::size_t> begin;  // start of each cluster, and the end

  std::size_t clusters() const { return begin.size() - 1; }
};

Clustered reductions(const WatersResult& result, std::uint32_t level, std::size_t m) {
  Clustered c;
  std::uint32_t set = 0;
  for (const WatersRow& row : result.rows) {
    if (row.level != level || row.bound[m] < 0) continue;
    if (c.value.empty() || row.set != set) c.begin.push_back(c.value.size());
    set = row.set;
    c.value.push_back(100 * row.reduction(m));
  }
  c.begin.push_back(c.value.size());
  return c;
}

/// Half width of the confidence interval of f's mean, `mean`, over all chains.
template <typename Function>
double clustered_half_width(const Clustered& c, double mean, Function&& f) {
  if (c.clusters() < 2) return kNoValue;
  double squares = 0;
  for (std::size_t g = 0; g < c.clusters(); ++g) {
    double residual = 0;
    for (std::size_t i = c.begin[g]; i < c.begin[g + 1]; ++i) residual += f(c.value[i]) - mean;
    squares += residual * residual;
  }
  const auto clusters = static_cast<double>(c.clusters());
  return kZ * std::sqrt(squares * clusters / (clusters - 1)) / static_cast<double>(c.value.size());
}

/// Woodruff interval: the interval of the share of chains below the quantile, translated to
/// quantiles.
ClusteredEstimate quantile_estimate(const Clustered& c, const std::vector<double>& sorted, double p) {
  const double q = quantile(sorted, p);
  if (c.clusters() < 2) return {q, kNoValue, kNoValue};
  const double half = clustered_half_width(c, p, [&](double x) { return x <= q ? 1.0 : 0.0; });
  return {q, quantile(sorted, std::max(p - half, 0.0)), quantile(sorted, std::min(p + half, 1.0))};
}

ClusteredEstimate wilson(double successes, double n) {
  if (n == 0) return {kNoValue, kNoValue, kNoValue};
  const double share = successes / n;
  const double scale = 1 + kZ * kZ / n;
  const double centre = (share + kZ * kZ / (2 * n)) / scale;
  const double half = kZ * std::sqrt(share * (1 - share) / n + kZ * kZ / (4 * n * n)) / scale;
  return {share, centre - half, centre + half};
}

void describe(const Clustered& c, WatersSummary& s) {
  const auto n = static_cast<double>(c.value.size());
  std::vector<double> sorted = c.value;
  std::sort(sorted.begin(), sorted.end());
  double sum = 0, squares = 0, positive = 0;
  for (const double x : c.value) {
    sum += x;
    positive += x > 0;
  }
  const double mean = n > 0 ? sum / n : kNoValue;
  const double share = n > 0 ? positive / n : kNoValue;
  for (const double x : c.value) squares += (x - mean) * (x - mean);
  s.deviation = n > 0 ? std::sqrt(squares / n) : kNoValue;
  const double mean_half = clustered_half_width(c, mean, [](double x) { return x; });
  const double share_half = clustered_half_width(c, share, [](double x) { return x > 0 ? 1.0 : 0.0; });
  s.mean = {mean, mean - mean_half, mean + mean_half};
  s.positive_share = {share, share - share_half, share + share_half};
  s.median = quantile_estimate(c, sorted, 0.5);
  s.p25 = quantile_estimate(c, sorted, 0.25);
  s.p75 = quantile_estimate(c, sorted, 0.75);
  s.min = quantile(sorted, 0);
  s.max = quantile(sorted, 1);
  s.p1 = quantile(sorted, 0.01);
  s.p5 = quantile(sorted, 0.05);
  s.p95 = quantile(sorted, 0.95);
  s.p99 = quantile(sorted, 0.99);
}

}  // namespace

std::vector<WatersSummary> summarise_waters(const WatersOptions& options, const WatersResult& result) {
  std::vector<WatersSummary> summaries;
  for (std::uint32_t level = 0; level < options.utilisations.size(); ++level) {
    for (std::size_t m = 0; m < options.methods.size(); ++m) {
      WatersSummary s;
      s.utilisation = options.utilisations[level];
      s.method = options.methods[m];
      for (const WatersSet& set : result.sets) {
        if (set.level != level) continue;
        ++s.sets;
        s.schedulable +=
            s.method == WatersMethod::brueggen_davare ? set.schedulable_brueggen : set.schedulable_davis;
      }
      s.schedulable_share = wilson(s.schedulable, s.sets);
      const Clustered c = reductions(result, level, m);
      s.chains = c.value.size();
      s.sets_with_chains = static_cast<std::uint32_t>(c.clusters());
      describe(c, s);
      summaries.push_back(s);
    }
  }
  return summaries;
}

std::vector<WatersHistogram> waters_histograms(const WatersOptions& options, const WatersResult& result,
                                               std::size_t bins) {
  std::vector<WatersHistogram> panels;
  for (std::uint32_t level = 0; level < options.utilisations.size(); ++level) {
    for (std::size_t m = 0; m < options.methods.size(); ++m) {
      const std::vector<double> value = reductions(result, level, m).value;
      WatersHistogram h{.utilisation = options.utilisations[level],
                        .method = options.methods[m],
                        .count = std::vector<std::uint64_t>(bins, 0)};
      if (!value.empty()) {
        const auto [low, high] = std::minmax_element(value.begin(), value.end());
        h.low = *low;
        h.width = (*high - *low) / static_cast<double>(bins);
        for (const double x : value) {
          const double bin = h.width > 0 ? (x - h.low) / h.width : 0;
          ++h.count[std::min(bins - 1, static_cast<std::size_t>(bin))];
        }
      }
      panels.push_back(std::move(h));
    }
  }
  return panels;
}

}  // namespace hotpath
