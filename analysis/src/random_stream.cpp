// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/random_stream.hpp"

#include <cassert>
#include <cmath>

#include "hotpath/core/workload.hpp"

namespace hotpath {

RandomStream::RandomStream(std::uint64_t seed, std::initializer_list<std::uint64_t> place) {
  std::uint64_t state = mix(seed);
  for (const std::uint64_t index : place) state = mix(state ^ mix(index));
  engine_.seed(state);
}

std::uint64_t RandomStream::below(std::uint64_t n) {
  assert(n > 0);
  const std::uint64_t rest = (~std::uint64_t{0} % n + 1) % n;  // 2^64 mod n
  std::uint64_t x = engine_();
  while (x > ~std::uint64_t{0} - rest) x = engine_();
  return x % n;
}

std::size_t RandomStream::pick(std::span<const double> cumulative) {
  const double u = uniform();
  std::size_t i = 0;
  while (i + 1 < cumulative.size() && u >= cumulative[i]) ++i;
  return i;
}

double RandomStream::weibull(double shape, double scale) {
  return scale * std::pow(-std::log1p(-uniform()), 1.0 / shape);
}

}  // namespace hotpath
