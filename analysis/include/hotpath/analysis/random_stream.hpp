// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>
#include <random>
#include <span>
#include <utility>

namespace hotpath {

/// Random numbers that are equal with every standard library. Each stream follows from one seed and
/// a place in the experiment, so that no draw depends on the draws of another thread or machine.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::initializer_list<std::uint64_t> place);

  /// Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  /// Uniform in {0, ..., n - 1}, without bias; n > 0.
  std::uint64_t below(std::uint64_t n);

  /// An index drawn with the given cumulative shares, the last of which is 1.
  std::size_t pick(std::span<const double> cumulative);

  /// Weibull-distributed with the given shape and scale.
  double weibull(double shape, double scale);

  template <typename T>
  void shuffle(std::span<T> items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[below(i)]);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace hotpath
