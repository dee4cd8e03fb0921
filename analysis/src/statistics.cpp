// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

namespace hotpath {
namespace {

/// The two order statistics around a quantile, counted from 0, and the weight of the upper one.
struct Position {
  std::uint64_t lower = 0;
  double share = 0;
};

Position position(std::uint64_t n, double probability) {
  assert(n > 0 && probability >= 0 && probability <= 1);
  const double place = static_cast<double>(n - 1) * probability;
  const double lower = std::floor(place);
  return {static_cast<std::uint64_t>(lower), place - lower};
}

double interpolate(double low, double high, double share) { return low + share * (high - low); }

/// Draws the number of occurrences of each repetition in a resample.
class Resampler {
 public:
  explicit Resampler(std::uint64_t seed) : random_(seed) {}

  void draw(std::vector<std::uint32_t>& times) {
    std::fill(times.begin(), times.end(), 0u);
    for (std::size_t k = 0; k < times.size(); ++k) ++times[below(times.size())];
  }

 private:
  // std::uniform_int_distribution differs between standard libraries; the bias here is below 2^-24.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(((random_() >> 32) * n) >> 32); }

  std::mt19937_64 random_;
};

std::optional<Interval> percentile_interval(std::vector<double> statistics, double confidence) {
  std::erase_if(statistics, [](double s) { return !std::isfinite(s); });
  if (statistics.empty()) return std::nullopt;
  std::sort(statistics.begin(), statistics.end());
  const double tail = (1 - confidence) / 2;
  return Interval{quantile(statistics, tail), quantile(statistics, 1 - tail)};
}

template <class Combine>
Estimate compare(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                 const BootstrapOptions& options, Combine combine) {
  Estimate result;
  result.value = combine(quantile(a.pooled(), probability), quantile(b.pooled(), probability));
  if (a.repetitions() < 2 || b.repetitions() < 2) return result;
  Resampler resampler(options.seed);
  std::vector<std::uint32_t> times_a(a.repetitions()), times_b(b.repetitions());
  std::vector<double> statistics(options.resamples);
  for (double& statistic : statistics) {
    resampler.draw(times_a);
    resampler.draw(times_b);
    if (options.pairs && times_a.size() == times_b.size()) times_b = times_a;
    statistic =
        combine(a.resampled_quantile(times_a, probability), b.resampled_quantile(times_b, probability));
  }
  result.interval = percentile_interval(std::move(statistics), options.confidence);
  return result;
}

}  // namespace

std::size_t nearest_rank(std::size_t count, double probability) {
  const double rank = std::ceil(probability * static_cast<double>(count));
  return rank < 1 ? 0 : std::min(static_cast<std::size_t>(rank), count) - 1;
}

double quantile(std::span<const double> ascending, double probability) {
  if (ascending.empty()) return kNoValue;
  const auto [lower, share] = position(ascending.size(), probability);
  if (share == 0) return ascending[lower];
  return interpolate(ascending[lower], ascending[lower + 1], share);
}

Quantiles quantiles(std::vector<double> samples) {
  Quantiles q;
  q.n = samples.size();
  if (samples.empty()) return q;
  std::sort(samples.begin(), samples.end());
  for (const QuantileTraits& traits : kQuantiles) q.*traits.of = quantile(samples, traits.probability);
  q.mean = std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(q.n);
  return q;
}

RepeatedSamples::RepeatedSamples(std::vector<std::vector<double>> repetitions) {
  std::erase_if(repetitions, [](const auto& samples) { return samples.empty(); });
  repetitions_ = repetitions.size();
  std::vector<std::pair<double, std::size_t>> merged;
  for (std::size_t r = 0; r < repetitions_; ++r) {
    sizes_.push_back(repetitions[r].size());
    for (const double sample : repetitions[r]) merged.emplace_back(sample, r);
  }
  std::sort(merged.begin(), merged.end());
  for (auto& samples : repetitions) std::sort(samples.begin(), samples.end());
  sorted_ = std::move(repetitions);

  pooled_.reserve(merged.size());
  ranks_.reserve(merged.size() * repetitions_);
  std::vector<std::uint32_t> held(repetitions_, 0);
  for (const auto& [sample, repetition] : merged) {
    pooled_.push_back(sample);
    ++held[repetition];
    ranks_.insert(ranks_.end(), held.begin(), held.end());
  }
}

double RepeatedSamples::order_statistic(std::span<const std::uint32_t> times, std::uint64_t rank) const {
  const auto pooled_up_to = [&](std::size_t i) {
    const std::uint32_t* row = &ranks_[i * repetitions_];
    return std::inner_product(times.begin(), times.end(), row, std::uint64_t{0});
  };
  std::size_t low = 0, high = pooled_.size() - 1;
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (pooled_up_to(middle) > rank) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return pooled_[low];
}

double RepeatedSamples::resampled_quantile(std::span<const std::uint32_t> times, double probability) const {
  assert(times.size() == repetitions_);
  const auto n = std::inner_product(times.begin(), times.end(), sizes_.begin(), std::uint64_t{0});
  if (n == 0) return kNoValue;
  const auto [lower, share] = position(n, probability);
  const double low = order_statistic(times, lower);
  return share == 0 ? low : interpolate(low, order_statistic(times, lower + 1), share);
}

std::vector<Estimate> estimate_quantiles(const RepeatedSamples& samples,
                                         std::span<const double> probabilities,
                                         const BootstrapOptions& options) {
  std::vector<Estimate> estimates(probabilities.size());
  for (std::size_t p = 0; p < probabilities.size(); ++p) {
    estimates[p].value = quantile(samples.pooled(), probabilities[p]);
  }
  if (samples.repetitions() < 2) return estimates;

  Resampler resampler(options.seed);
  std::vector<std::uint32_t> times(samples.repetitions());
  std::vector<std::vector<double>> statistics(probabilities.size());
  for (std::uint32_t k = 0; k < options.resamples; ++k) {
    resampler.draw(times);
    for (std::size_t p = 0; p < probabilities.size(); ++p) {
      statistics[p].push_back(samples.resampled_quantile(times, probabilities[p]));
    }
  }
  for (std::size_t p = 0; p < probabilities.size(); ++p) {
    estimates[p].interval = percentile_interval(std::move(statistics[p]), options.confidence);
  }
  return estimates;
}

Estimate ratio_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                            const BootstrapOptions& options) {
  return compare(a, b, probability, options, [](double x, double y) { return x / y; });
}

Estimate difference_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                                 const BootstrapOptions& options) {
  return compare(a, b, probability, options, [](double x, double y) { return x - y; });
}

namespace {

/// Number of pairs in which the sample of `a` is smaller, minus the number in which it is larger;
/// both ascending.
double wins(const std::vector<double>& a, const std::vector<double>& b) {
  double difference = 0;
  auto smaller = b.begin(), not_larger = b.begin();
  for (const double sample : a) {
    while (smaller != b.end() && *smaller < sample) ++smaller;
    while (not_larger != b.end() && *not_larger <= sample) ++not_larger;
    difference += static_cast<double>(b.end() - not_larger) - static_cast<double>(smaller - b.begin());
  }
  return difference;
}

/// Cliff's delta of resamples, from the pair counts of each two repetitions.
class PairwiseWins {
 public:
  PairwiseWins(const RepeatedSamples& a, const RepeatedSamples& b) : columns_(b.repetitions()) {
    for (std::size_t i = 0; i < a.repetitions(); ++i) {
      for (std::size_t j = 0; j < columns_; ++j) {
        wins_.push_back(wins(a.repetition(i), b.repetition(j)));
        pairs_.push_back(static_cast<double>(a.repetition(i).size() * b.repetition(j).size()));
      }
    }
  }

  double delta(std::span<const std::uint32_t> times_a, std::span<const std::uint32_t> times_b) const {
    double won = 0, pairs = 0;
    for (std::size_t k = 0; k < wins_.size(); ++k) {
      const double times = static_cast<double>(times_a[k / columns_]) * times_b[k % columns_];
      won += times * wins_[k];
      pairs += times * pairs_[k];
    }
    return pairs > 0 ? won / pairs : kNoValue;
  }

 private:
  std::size_t columns_;
  std::vector<double> wins_, pairs_;
};

}  // namespace

Estimate cliffs_delta(const RepeatedSamples& a, const RepeatedSamples& b, const BootstrapOptions& options) {
  const PairwiseWins wins(a, b);
  std::vector<std::uint32_t> times_a(a.repetitions(), 1), times_b(b.repetitions(), 1);
  Estimate result{wins.delta(times_a, times_b), std::nullopt};
  if (a.repetitions() < 2 && b.repetitions() < 2) return result;
  Resampler resampler(options.seed);
  std::vector<double> statistics(options.resamples);
  for (double& statistic : statistics) {
    resampler.draw(times_a);
    resampler.draw(times_b);
    statistic = wins.delta(times_a, times_b);
  }
  result.interval = percentile_interval(std::move(statistics), options.confidence);
  return result;
}

double rank_test(const RepeatedSamples& a, const RepeatedSamples& b) {
  const std::vector<double>&x = a.pooled(), &y = b.pooled();
  if (x.empty() || y.empty()) return kNoValue;
  std::vector<double> both(x.size() + y.size());
  std::merge(x.begin(), x.end(), y.begin(), y.end(), both.begin());
  double ties = 0;
  for (auto first = both.begin(); first != both.end();) {
    const auto last = std::upper_bound(first, both.end(), *first);
    const auto equal = static_cast<double>(last - first);
    ties += equal * equal * equal - equal;
    first = last;
  }
  const auto n = static_cast<double>(both.size());
  const double pairs = static_cast<double>(x.size()) * static_cast<double>(y.size());
  const double variance = pairs / 12 * (n + 1 - ties / (n * (n - 1)));
  if (variance <= 0) return 1;
  return std::min(1.0, std::erfc((std::abs(wins(x, y)) - 1) / 2 / std::sqrt(2 * variance)));
}

Line fit_line(std::span<const double> x, std::span<const double> y, std::span<const double> weights) {
  assert(x.size() == y.size() && x.size() == weights.size());
  double total = 0, mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    total += weights[i];
    mean_x += weights[i] * x[i];
    mean_y += weights[i] * y[i];
  }
  mean_x /= total;
  mean_y /= total;
  double along = 0, across = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    along += weights[i] * (x[i] - mean_x) * (x[i] - mean_x);
    across += weights[i] * (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (along == 0) return {mean_y / mean_x, 0};
  return {across / along, mean_y - across / along * mean_x};
}

}  // namespace hotpath
