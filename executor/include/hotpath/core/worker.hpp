// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cassert>
#include <cstdint>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

/// Index of one thread of an executor, below kMaxWorkers.
using Worker = std::uint32_t;
inline constexpr Worker kMaxWorkers = 64;

/// The role of a worker; drivers derive its default thread policy from it.
enum class WorkerRole : std::uint8_t {
  executor,          ///< rclcpp's executor thread (the paper's *default thread*).
  timer_management,  ///< The releaser (the paper's *timer management thread*); in RE it also runs the timers'
                     ///< jobs.
};
constexpr auto enum_texts(WorkerRole) { return texts_in_order<WorkerRole>({"executor", "timer_mgmt"}); }

/// A set of workers.
class WorkerSet {
 public:
  constexpr WorkerSet() = default;
  static constexpr WorkerSet of(Worker w) {
    WorkerSet s;
    s.insert(w);
    return s;
  }
  constexpr void insert(Worker w) {
    assert(w < kMaxWorkers);
    bits_ |= std::uint64_t{1} << w;
  }
  constexpr void erase(Worker w) { bits_ &= ~(std::uint64_t{1} << w); }
  [[nodiscard]] constexpr bool contains(Worker w) const { return (bits_ >> w) & 1U; }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  /// The smallest member; the set must not be empty.
  [[nodiscard]] constexpr Worker first() const {
    assert(!empty());
    return static_cast<Worker>(std::countr_zero(bits_));
  }
  constexpr Worker pop_first() {
    const Worker w = first();
    erase(w);
    return w;
  }
  constexpr WorkerSet& operator|=(WorkerSet o) {
    bits_ |= o.bits_;
    return *this;
  }
  /// Bit w: whether `w` is a member.
  [[nodiscard]] constexpr std::uint64_t bits() const { return bits_; }
  friend constexpr bool operator==(WorkerSet, WorkerSet) = default;

 private:
  std::uint64_t bits_ = 0;
};

}  // namespace hotpath
