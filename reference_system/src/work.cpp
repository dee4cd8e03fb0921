// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/work.hpp"

#include <cmath>
#include <ctime>
#include <set>

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

/// Reading this clock is a system call of up to a microsecond.
Time thread_cpu_clock() { return Time(read_clock(CLOCK_THREAD_CPUTIME_ID)); }

/// More than 50 us, because the last readings of a job are closer to each other.
constexpr Duration kBetweenReads = std::chrono::microseconds(60);

}  // namespace

std::int64_t WorkPart::burn(Time start) const {
  if (duration <= Duration::zero()) return 0;
  switch (mode) {
    case WorkMode::fixed:
      return count_primes(limit);
    case WorkMode::wall:
      return count_primes_until(now(), start + duration, Duration{}, now);
    case WorkMode::cpu_time: {
      const Time begin = thread_cpu_clock();
      return count_primes_until(begin, begin + duration, kBetweenReads, thread_cpu_clock);
    }
  }
  return 0;
}

std::vector<WorkPart> parts_of(WorkMode mode, const Callback& callback, double divisions_per_us) {
  std::set<double> ends = {1};
  for (const Publication& p : callback.publishes) ends.insert(p.at);
  std::vector<WorkPart> parts;
  double begin = 0;
  for (const double end : ends) {
    // Work until an instant counts from the start of the job.
    const double share = mode == WorkMode::wall ? end : end - begin;
    const auto time = Duration(std::llround(share * static_cast<double>(callback.worst.count())));
    parts.push_back({end, mode, time, mode == WorkMode::fixed ? crunch_limit(time, divisions_per_us) : 0});
    begin = end;
  }
  return parts;
}

}  // namespace hotpath
