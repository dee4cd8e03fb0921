// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// Lets one thread sleep until an absolute instant of CLOCK_MONOTONIC or until another wakes it. Unlike a
/// condition variable it takes no mutex on waking, and the waking thread decides under its own lock whether
/// anybody sleeps.
class Parker {
 public:
  /// To be read, under the lock that guards the condition, before park_until().
  [[nodiscard]] std::uint32_t ticket() const { return ticket_.load(std::memory_order_relaxed); }

  /// Sleeps until `until` (kNever: no limit), or until unpark() was called after `ticket` was read. May wake
  /// early.
  void park_until(std::uint32_t ticket, Time until);

  void unpark();

 private:
  std::atomic<std::uint32_t> ticket_{0};
};

}  // namespace hotpath
