// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace hotpath {

inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// Index among `count` > 0 ascending samples of the smallest one that at least the share `probability`
/// in [0, 1] of them do not exceed (nearest rank): where the value must be one of the samples.
std::size_t nearest_rank(std::size_t count, double probability);

/// Quantile of ascending samples by linear interpolation between the two samples around (n - 1) *
/// probability (Hyndman and Fan 1996, type 7, the default of NumPy and R). The quantile at 1/2 is
/// the median, at 0 and 1 the extremes. A single sample equals all of its quantiles; without
/// samples the result is NaN. `probability` in [0, 1].
double quantile(std::span<const double> ascending, double probability);

/// Summary of a sample, in the unit of the samples; without samples all values but `n` are NaN.
struct Quantiles {
  std::size_t n = 0;
  double min = kNoValue, max = kNoValue, mean = kNoValue;
  double p50 = kNoValue, p90 = kNoValue, p99 = kNoValue, p999 = kNoValue;
};
/// The quantiles of a summary: key, also in JSON, and whether a latency of several repetitions has a
/// confidence interval of it.
struct QuantileTraits {
  const char* key;
  double probability;
  double Quantiles::*of;
  bool has_interval;
};
inline constexpr QuantileTraits kQuantiles[] = {
    {"min", 0, &Quantiles::min, false},      {"p50", 0.5, &Quantiles::p50, true},
    {"p90", 0.9, &Quantiles::p90, false},    {"p99", 0.99, &Quantiles::p99, true},
    {"p999", 0.999, &Quantiles::p999, true}, {"max", 1, &Quantiles::max, true}};
/// Computes the summary; `samples` may be in any order.
Quantiles quantiles(std::vector<double> samples);

/// A confidence interval.
struct Interval {
  double low = kNoValue;
  double high = kNoValue;
};

/// A statistic of all samples with its confidence interval, if there are at least two repetitions.
struct Estimate {
  double value = kNoValue;
  std::optional<Interval> interval;

  /// Whether a ratio or difference is beyond noise: the interval does not contain `neutral`.
  [[nodiscard]] bool excludes(double neutral) const {
    return interval && (interval->high < neutral || interval->low > neutral);
  }
};

/// Parameters of a bootstrap.
struct BootstrapOptions {
  std::uint32_t resamples = 2000;
  double confidence = 0.95;  ///< In (0, 1).
  std::uint64_t seed = 1;    ///< The same seed gives the same intervals, with every standard library.
  bool pairs = false;        ///< Of two sides with as many repetitions: their i-th ones are drawn together.
};

/// The samples of several repetitions, arranged so that a quantile of any resampled pool costs one
/// binary search. Omits repetitions without samples.
class RepeatedSamples {
 public:
  explicit RepeatedSamples(std::vector<std::vector<double>> repetitions);

  std::size_t repetitions() const { return repetitions_; }
  /// Samples of one repetition, ascending.
  const std::vector<double>& repetition(std::size_t r) const { return sorted_[r]; }
  /// All samples, ascending.
  const std::vector<double>& pooled() const { return pooled_; }
  /// The quantile(), in the sense of quantile(), of a pool that contains each sample of repetition
  /// r `times[r]` times.
  double resampled_quantile(std::span<const std::uint32_t> times, double probability) const;

 private:
  double order_statistic(std::span<const std::uint32_t> times, std::uint64_t rank) const;

  std::size_t repetitions_ = 0;
  std::vector<double> pooled_;
  std::vector<std::vector<double>> sorted_;  ///< By repetition.
  std::vector<std::size_t> sizes_;           ///< Samples of each repetition.
  std::vector<std::uint32_t> ranks_;         ///< Row i: number of samples in pooled_[0..i], by repetition.
};

/// Quantiles of the pooled samples with bootstrap intervals (Efron's percentile method). Whole
/// repetitions are resampled, with replacement, and pooled, because the samples of one repetition
/// are not independent. With fewer than two repetitions there is no interval: one run does not show
/// how runs differ. With few repetitions the intervals tend to be too narrow, and the interval of
/// the maximum never exceeds the largest sample.
std::vector<Estimate> estimate_quantiles(const RepeatedSamples& samples,
                                         std::span<const double> probabilities,
                                         const BootstrapOptions& options = {});

/// Quantile of `a` divided by, or minus, the same quantile of `b`; both are resampled
/// independently, unless they are pairs. An interval that excludes 1, or 0, indicates a difference beyond
/// noise.
Estimate ratio_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                            const BootstrapOptions& options = {});
Estimate difference_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                                 const BootstrapOptions& options = {});

/// Cliff's delta in [-1, 1]: the share of pairs in which the sample of `a` is smaller, minus the
/// share in which it is larger. The interval is over repetitions of both sides; there is none if
/// neither side has two repetitions. NaN if a side has no samples.
Estimate cliffs_delta(const RepeatedSamples& a, const RepeatedSamples& b,
                      const BootstrapOptions& options = {});

/// Two-sided p-value of the rank test of Mann and Whitney (1947) on the pooled samples: normal approximation,
/// corrected for ties and continuity. It treats samples as independent. NaN without samples on one side.
double rank_test(const RepeatedSamples& a, const RepeatedSamples& b);

struct Line {
  double slope = kNoValue;
  double intercept = kNoValue;
};

/// The line with the least weighted squares of the vertical distances to the points. If all points have the
/// same x, it passes through the origin. The spans have equal lengths; weights are positive.
Line fit_line(std::span<const double> x, std::span<const double> y, std::span<const double> weights);

}  // namespace hotpath
