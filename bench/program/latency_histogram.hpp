// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath::program {

/// A histogram of durations. A bucket is at most 1/64 of its values wide, so quantiles are within
/// 1 % of the exact values, in a few kilobytes for any number of samples.
class LatencyHistogram {
 public:
  /// Negative durations count as 0.
  void add(Duration sample) {
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(sample.count(), 0));
    const std::size_t bucket = bucket_of(ns);
    if (bucket >= counts_.size()) counts_.resize(bucket + 1);
    ++counts_[bucket];
    ++count_;
    max_ = std::max(max_, sample);
  }

  std::uint64_t count() const { return count_; }
  /// -1 ns when there are no samples.
  Duration max() const { return max_; }

  /// The sample at nearest_rank(); -1 ns when there are no samples.
  Duration quantile(double probability) const {
    if (count_ == 0) return Duration(-1);
    const std::size_t rank = nearest_rank(count_, probability);
    std::uint64_t below = 0;
    std::size_t bucket = 0;
    while ((below += counts_[bucket]) <= rank) ++bucket;
    return std::min(middle_of(bucket), max_);
  }

 private:
  /// Values below 2^7 have a bucket each; every further power of two is divided into 2^6 buckets.
  static constexpr int kDigits = 7;
  static constexpr std::size_t kPerOctave = std::size_t{1} << (kDigits - 1);

  static std::size_t bucket_of(std::uint64_t ns) {
    const int shift = std::max(0, static_cast<int>(std::bit_width(ns)) - kDigits);
    return static_cast<std::size_t>(shift) * kPerOctave + static_cast<std::size_t>(ns >> shift);
  }
  static Duration middle_of(std::size_t bucket) {
    if (bucket < 2 * kPerOctave) return Duration(static_cast<std::int64_t>(bucket));
    const std::size_t shift = bucket / kPerOctave - 1;
    const std::uint64_t digits = bucket - shift * kPerOctave;
    return Duration(static_cast<std::int64_t>((digits << shift) + (std::uint64_t{1} << shift) / 2));
  }

  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  Duration max_{-1};
};

}  // namespace hotpath::program
