// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "event.hpp"

namespace hotpath {

/// Keeps samples whose run is not known yet, bounded in number and in bytes.
class PendingSamples {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Drops the oldest samples beyond the bounds.
  void keep(Event event, Time arrived);
  void forget(Time arrived_before);
  /// Removes and returns the samples of this run, in order.
  std::vector<Event> take(const std::string& run);
  /// Number of samples dropped since the start.
  std::uint64_t forgotten() const { return forgotten_; }

 private:
  void forget_oldest();

  std::deque<std::pair<Time, Event>> samples_;
  std::size_t bytes_ = 0;
  std::uint64_t forgotten_ = 0;
};

}  // namespace hotpath
