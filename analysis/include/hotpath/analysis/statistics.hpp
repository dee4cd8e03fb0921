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

/// Quantile of ascending samples by linear interpolation between the two samples around (n - 1) * probability
/// (Hyndman and Fan 1996, type 7, as NumPy and R). The quantile at 1/2 is the median, at 0 and 1 the
/// extremes. One sample is all of its quantiles; none have none: NaN. `probability` lies in [0, 1].
double quantile(std::span<const double> ascending, double probability);

/// A sample's shape, in the unit of the samples; all but `n` are NaN when there are none.
struct Quantiles {
  std::size_t n = 0;
  double min = kNoValue;
  double p50 = kNoValue;
  double p90 = kNoValue;
  double p99 = kNoValue;
  double p999 = kNoValue;
  double max = kNoValue;
  double mean = kNoValue;
};
Quantiles quantiles(std::vector<double> samples);

struct Interval {
  double low = kNoValue;
  double high = kNoValue;
};

/// A statistic of all samples and, where there are two repetitions or more, its confidence interval.
struct Estimate {
  double value = kNoValue;
  std::optional<Interval> interval;
};

struct BootstrapOptions {
  std::uint32_t resamples = 2000;
  double confidence = 0.95;  ///< In (0, 1).
  std::uint64_t seed = 1;    ///< The same seed gives the same intervals, with every standard library.
};

/// The samples of several repetitions, arranged so that a quantile of any resampled pool costs a binary
/// search. Repetitions without samples are left out.
class RepeatedSamples {
 public:
  explicit RepeatedSamples(std::vector<std::vector<double>> repetitions);

  std::size_t repetitions() const { return repetitions_; }
  /// Samples of one repetition, ascending.
  const std::vector<double>& repetition(std::size_t r) const { return sorted_[r]; }
  /// All samples, ascending.
  const std::vector<double>& pooled() const { return pooled_; }
  /// Quantile, as quantile(), of the pool that has each sample of repetition r `times[r]` times.
  double resampled_quantile(std::span<const std::uint32_t> times, double probability) const;

 private:
  double order_statistic(std::span<const std::uint32_t> times, std::uint64_t rank) const;

  std::size_t repetitions_ = 0;
  std::vector<double> pooled_;
  std::vector<std::vector<double>> sorted_;  ///< By repetition.
  std::vector<std::size_t> sizes_;           ///< Samples of each repetition.
  std::vector<std::uint32_t> ranks_;         ///< Row i: how many of pooled_[0..i] each repetition holds.
};

/// Quantiles of the pooled samples with bootstrap intervals (Efron's percentile method). Whole repetitions
/// are resampled, with replacement, and pooled, because the samples of one repetition are not independent.
/// There is no interval for fewer than two repetitions: one run does not tell how runs differ. With few
/// repetitions intervals are rather too narrow, and the interval of the maximum never exceeds the largest
/// sample.
std::vector<Estimate> estimate_quantiles(const RepeatedSamples& samples,
                                         std::span<const double> probabilities,
                                         const BootstrapOptions& options = {});

/// Quantile of `a` divided by, or minus, that of `b`, both resampled independently of each other. An interval
/// that leaves out 1, or 0, marks a difference beyond noise.
Estimate ratio_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                            const BootstrapOptions& options = {});
Estimate difference_of_quantiles(const RepeatedSamples& a, const RepeatedSamples& b, double probability,
                                 const BootstrapOptions& options = {});

/// Cliff's delta: the share of pairs in which the sample of `a` is the smaller one minus the share in which
/// it is the larger one, in [-1, 1]. The interval is over repetitions of both sides; there is none when
/// neither side has two repetitions. NaN without samples on one side.
Estimate cliffs_delta(const RepeatedSamples& a, const RepeatedSamples& b,
                      const BootstrapOptions& options = {});

}  // namespace hotpath
