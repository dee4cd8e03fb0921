// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hotpath {

/// A set of numbers below a limit.
class NumberSet {
 public:
  explicit NumberSet(std::size_t limit = 0) : words_((limit + 63) / 64, 0) {}
  void insert(std::size_t number) { words_[number / 64] |= std::uint64_t{1} << number % 64; }
  void erase(std::size_t number) { words_[number / 64] &= ~(std::uint64_t{1} << number % 64); }
  /// In ascending order.
  template <class Visit>
  void visit(Visit&& visit) const {
    for (std::size_t i = 0; i < words_.size(); ++i)
      for (std::uint64_t rest = words_[i]; rest != 0; rest &= rest - 1)
        visit(64 * i + static_cast<std::size_t>(std::countr_zero(rest)));
  }

 private:
  std::vector<std::uint64_t> words_;
};

}  // namespace hotpath
