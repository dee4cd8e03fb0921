// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// Lets one thread sleep until an absolute instant of CLOCK_MONOTONIC or until another thread wakes
/// it. Unlike a condition variable it takes no mutex on waking; the waking thread decides under its
/// own lock whether a thread sleeps.
class Parker {
 public:
  /// Must be read before park_until(), under the lock that guards the condition.
  [[nodiscard]] std::uint32_t ticket() const { return ticket_.load(std::memory_order_relaxed); }

  /// Sleeps until `until` (kNever: no limit), or until unpark() is called after `ticket` was read.
  /// May wake early.
  void park_until(std::uint32_t ticket, Time until);

  void unpark();

 private:
  std::atomic<std::uint32_t> ticket_{0};
};

}  // namespace hotpath
