// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/work.hpp"

#include <ctime>

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

Time thread_cpu_clock() { return Time(read_clock(CLOCK_THREAD_CPUTIME_ID)); }

}  // namespace

std::int64_t Work::burn(Time start) const {
  if (duration_ <= Duration::zero()) return 0;
  switch (mode_) {
    case WorkMode::fixed:
      return count_primes(limit_);
    case WorkMode::wall:
      return count_primes_until(limit_, start + duration_, now);
    case WorkMode::cpu_time:
      return count_primes_until(limit_, thread_cpu_clock() + duration_, thread_cpu_clock);
  }
  return 0;
}

}  // namespace hotpath
