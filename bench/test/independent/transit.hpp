// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <random>
#include <utility>

#include "simulation_state.hpp"

namespace independent {

/// Samples on their way from publishers to subscriptions. Those of one publisher and subscription keep their
/// order.
class Transit {
 public:
  Transit(const Delay& delay, bool any_order) : delay_(delay), any_order_(any_order) {}

  void send(int reader, const Sample& sample) {
    Arrival& last = last_[{sample.parent, reader}];
    last = std::max(last, {sample.published + delay_(), any_order_ ? random_() : 0});
    samples_.emplace(last, std::pair(reader, sample));
  }

  /// The next sample that has arrived, and its subscription. In any order, it may also arrive behind the next
  /// decision.
  std::optional<std::pair<int, Sample>> take(Nanoseconds now) {
    if (next() > now || (any_order_ && random_() % 2 == 0)) return std::nullopt;
    return samples_.extract(samples_.begin()).mapped();
  }

  Nanoseconds next() const { return samples_.empty() ? kNever : samples_.begin()->first.first; }

 private:
  using Arrival = std::pair<Nanoseconds, std::uint64_t>;  ///< Instant, and order among those of one instant.

  const Delay& delay_;
  const bool any_order_;
  std::multimap<Arrival, std::pair<int, Sample>> samples_{};
  std::map<std::pair<int, int>, Arrival> last_{};  ///< By publisher and subscription.
  std::mt19937_64 random_{1};
};

}  // namespace independent
