// SPDX-License-Identifier: Apache-2.0
#include "hotpath/live/parker.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>

namespace hotpath {

namespace {

long futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value, const timespec* until) {
  static_assert(sizeof(word) == sizeof(std::uint32_t));
  return syscall(SYS_futex, &word, operation, value, until, nullptr, FUTEX_BITSET_MATCH_ANY);
}

}  // namespace

void Parker::park_until(std::uint32_t ticket, Time until) {
  timespec instant{};
  if (until != kNever) {
    instant.tv_sec = to_ns(until) / 1'000'000'000;
    instant.tv_nsec = to_ns(until) % 1'000'000'000;
  }
  // WAIT_BITSET takes an absolute instant of CLOCK_MONOTONIC.
  futex(ticket_, FUTEX_WAIT_BITSET_PRIVATE, ticket, until == kNever ? nullptr : &instant);
}

void Parker::unpark() {
  ticket_.fetch_add(1, std::memory_order_relaxed);
  futex(ticket_, FUTEX_WAKE_PRIVATE, 1, nullptr);
}

}  // namespace hotpath
