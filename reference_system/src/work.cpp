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

std::int64_t Work::burn(Time start) const {
  if (duration_ <= Duration::zero()) return 0;
  switch (mode_) {
    case WorkMode::fixed:
      return count_primes(limit_);
    case WorkMode::wall:
      return count_primes_until(now(), start + duration_, Duration{}, now);
    case WorkMode::cpu_time: {
      const Time begin = thread_cpu_clock();
      return count_primes_until(begin, begin + duration_, kBetweenReads, thread_cpu_clock);
    }
  }
  return 0;
}

std::vector<WorkPart> parts_of(WorkMode mode, const Callback& callback, const CrunchScale& scale) {
  std::set<double> ends = {1};
  for (const Publication& p : callback.publishes) ends.insert(p.at);
  std::vector<WorkPart> parts;
  double begin = 0;
  for (const double end : ends) {
    // Work until an instant counts from the start of the job.
    const double share = mode == WorkMode::wall ? end : end - begin;
    const auto time = Duration(std::llround(share * static_cast<double>(callback.worst.count())));
    parts.push_back({end, Work(mode, time, scale)});
    begin = end;
  }
  return parts;
}

}  // namespace hotpath
