// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// A time for each of some numbers below a limit, kNever at first, and the earliest of them: a tournament
/// tree. A change costs O(log limit) at most.
class EarliestTime {
 public:
  /// Forgets all times.
  void resize(std::size_t limit) {
    leaves_ = std::bit_ceil(std::max<std::size_t>(limit, 1));
    tree_.assign(2 * leaves_, kNever);
  }

  void set(std::size_t number, Time time) {
    std::size_t at = leaves_ + number;
    tree_[at] = time;
    for (at /= 2; at > 0; at /= 2) {
      const Time earlier = std::min(tree_[2 * at], tree_[2 * at + 1]);
      if (tree_[at] == earlier) break;
      tree_[at] = earlier;
    }
  }

  [[nodiscard]] Time time() const { return tree_[1]; }

  /// The smallest number that has this time.
  [[nodiscard]] std::size_t number() const {
    std::size_t at = 1;
    while (at < leaves_) at = 2 * at + (tree_[2 * at] == tree_[at] ? 0 : 1);
    return at - leaves_;
  }

 private:
  std::size_t leaves_ = 1;
  std::vector<Time> tree_ = {kNever, kNever};  // of node i, 2 i and 2 i + 1 are the children
};

}  // namespace hotpath
