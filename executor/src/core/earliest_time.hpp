// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// A tournament tree: holds a time for each number below a limit, initially kNever, and finds the
/// earliest. A change costs at most O(log limit).
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

  /// The smallest number with this time.
  [[nodiscard]] std::size_t number() const {
    std::size_t at = 1;
    while (at < leaves_) at = 2 * at + (tree_[2 * at] == tree_[at] ? 0 : 1);
    return at - leaves_;
  }

 private:
  std::size_t leaves_ = 1;
  std::vector<Time> tree_ = {kNever, kNever};  // nodes 2 i and 2 i + 1 are the children of node i
};

}  // namespace hotpath
