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

/// The time that a trace covers.
struct RecordedTime {
  Time begin, end;
  [[nodiscard]] Duration length() const { return end - begin; }
};

/// Regular samples that go on until the end or for half of the recording have one timer. A few others
/// are repeated one by one and once, more of them recur in the recorded order, but not within the length
/// of the recording, and of very many the timers' jitter covers the arrivals. `at`: the arrivals,
/// ascending, at least one.
[[nodiscard]] OutsideReleases outside_releases(const std::vector<Time>& at, const RecordedTime& recorded);

}  // namespace hotpath::imports
