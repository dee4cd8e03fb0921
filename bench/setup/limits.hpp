// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::setup {

/// The accepted values of a number, both ends included.
struct Limits {
  double least, most;
};

/// --load and --rate in percent, and --copies.
inline constexpr Limits kLoads{0, 10000}, kRates{0.001, 1e6}, kCopies{1, 1000};

}  // namespace hotpath::setup
