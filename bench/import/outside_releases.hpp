// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath::imports {

/// Timers that together release the samples of a topic that no recorded callback published.
struct OutsideReleases {
  std::vector<Time> first;      ///< By timer: its first timestamp.
  Duration period{}, jitter{};  ///< Of each of them; jitter < period.
  std::string timers;           ///< Names them in a sentence.
};

/// Regular samples have one timer. A few irregular ones are repeated one by one and once, more of them
/// recur in the recorded order, and of very many the timers' jitter covers the arrivals. `at`: the
/// arrivals, ascending, at least one.
[[nodiscard]] OutsideReleases outside_releases(const std::vector<Time>& at);

}  // namespace hotpath::imports
