// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <vector>

namespace hotpath {

/// A set of integer points that is given by bounds of all differences of their coordinates: a
/// difference-bound matrix (Dill 1989, "Timing assumptions and verification of finite-state concurrent
/// systems"), always closed, so that each bound is attained. Coordinate 0 is the constant 0. Points are
/// integers, so that every bound is one of "at most".
class Zone {
 public:
  /// The point 0 of that many coordinates, the constant included.
  explicit Zone(std::size_t size = 1) : size_(size), most_(size * size, 0) {}

  [[nodiscard]] std::size_t size() const { return size_; }
  /// The largest x_a - x_b.
  [[nodiscard]] std::int64_t most(std::size_t a, std::size_t b) const { return most_[a * size_ + b]; }
  [[nodiscard]] std::int64_t highest(std::size_t a) const { return most(a, 0); }
  [[nodiscard]] std::int64_t lowest(std::size_t a) const { return -most(0, a); }
  [[nodiscard]] bool fixed(std::size_t a) const { return lowest(a) == highest(a); }

  /// Keeps the points with x_a - x_b <= bound; false: there is none, and the zone is of no use any more.
  [[nodiscard]] bool limit(std::size_t a, std::size_t b, std::int64_t bound) {
    if (bound >= most(a, b)) return true;
    if (bound < -most(b, a)) return false;
    at(a, b) = bound;
    for (std::size_t i = 0; i < size_; ++i) {
      const std::int64_t to_a = most(i, a) + bound;
      for (std::size_t j = 0; j < size_; ++j) at(i, j) = std::min(at(i, j), to_a + most(b, j));
    }
    return true;
  }
  /// Keeps the points with x_a == x_b + offset.
  [[nodiscard]] bool equate(std::size_t a, std::size_t b, std::int64_t offset = 0) {
    return limit(a, b, offset) && limit(b, a, -offset);
  }

  /// x_a becomes any of x_b + [low, high]; `a` is not 0.
  void assign(std::size_t a, std::size_t b, std::int64_t low, std::int64_t high) {
    for (std::size_t i = 0; i < size_; ++i) {
      if (i == a) continue;
      at(a, i) = most(b, i) + high;
      at(i, a) = most(i, b) - low;
    }
  }
  /// x_a becomes x_b + offset.
  void assign(std::size_t a, std::size_t b, std::int64_t offset) { assign(a, b, offset, offset); }
  /// All coordinates but the constant grow by this.
  void shift(std::int64_t by) {
    for (std::size_t i = 1; i < size_; ++i) {
      at(i, 0) += by;
      at(0, i) -= by;
    }
  }
  /// One more coordinate, any of x_b + [low, high]; returns its number.
  std::size_t add(std::size_t b, std::int64_t low = 0, std::int64_t high = 0) {
    std::vector<std::size_t> all(size_ + 1, 0);
    std::iota(all.begin(), all.end() - 1, std::size_t{0});
    *this = select(all);
    assign(size_ - 1, b, low, high);
    return size_ - 1;
  }
  /// The coordinates with these numbers alone, in this order; the first is the constant.
  [[nodiscard]] Zone select(const std::vector<std::size_t>& numbers) const {
    Zone chosen(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      for (std::size_t j = 0; j < numbers.size(); ++j) chosen.at(i, j) = most(numbers[i], numbers[j]);
    }
    return chosen;
  }

  [[nodiscard]] bool contains(const Zone& other) const {
    assert(size_ == other.size_ && "two zones with other coordinates");
    return std::equal(most_.begin(), most_.end(), other.most_.begin(), std::greater_equal<>());
  }

  /// The point that has the least x_first, and of these the least x_1, x_2 and so on.
  [[nodiscard]] std::vector<std::int64_t> point(std::size_t first) const {
    Zone rest = *this;
    std::vector<std::int64_t> values(size_);
    const auto fix = [&](std::size_t i) {
      values[i] = rest.lowest(i);
      static_cast<void>(rest.limit(i, 0, values[i]));
    };
    fix(first);
    for (std::size_t i = 1; i < size_; ++i) fix(i);
    return values;
  }

  /// The union of two zones of one size, if it is a zone.
  [[nodiscard]] static std::optional<Zone> joined(const Zone& a, const Zone& b) {
    if (a.contains(b)) return a;
    if (b.contains(a)) return b;
    Zone hull = a;
    for (std::size_t i = 0; i < hull.most_.size(); ++i) hull.most_[i] = std::max(a.most_[i], b.most_[i]);
    // Whatever of the hull lies outside of `a` violates one of its bounds, and must lie in `b`.
    for (std::size_t i = 0; i < a.size_; ++i) {
      for (std::size_t j = 0; j < a.size_; ++j) {
        if (i == j || a.most(i, j) >= hull.most(i, j)) continue;
        Zone outside = hull;
        if (outside.limit(j, i, -a.most(i, j) - 1) && !b.contains(outside)) return std::nullopt;
      }
    }
    return hull;
  }

 private:
  std::int64_t& at(std::size_t a, std::size_t b) { return most_[a * size_ + b]; }

  std::size_t size_;
  std::vector<std::int64_t> most_;  // by row a, column b
};

}  // namespace hotpath
