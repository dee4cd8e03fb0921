// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/work.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <set>
#include <vector>

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

// Keeps the compiler from moving work across candidates or dropping it.
inline void barrier() { asm volatile("" ::: "memory"); }

/// From 2 on; the candidate itself if it is prime.
inline std::uint32_t smallest_divisor(std::uint32_t candidate) {
  // 64 bits, like upstream's numbers; trial division by every smaller number, not only up to the
  // square root.
  std::uint64_t n = candidate;
  asm volatile("" : "+r"(n));
  std::uint64_t divisor = 2;
  while (divisor < n && n % divisor != 0) ++divisor;
  return static_cast<std::uint32_t>(divisor);
}

/// Number of trial divisions of count_primes(limit).
std::uint64_t divisions_of(std::uint32_t limit) {
  // A composite takes d - 1 divisions, where d is its smallest divisor, and a prime p takes p - 2.
  std::vector<std::uint32_t> smallest(limit + 1, 0);
  std::uint64_t total = 0;
  for (std::uint32_t n = 2; n <= limit; ++n) {
    total += smallest[n] == 0 ? n - 2 : smallest[n] - 1;
    if (smallest[n] != 0) continue;
    for (std::uint64_t m = std::uint64_t{n} * n; m <= limit; m += n)
      if (smallest[m] == 0) smallest[m] = n;
  }
  return total;
}

/// Reading this clock is a system call of up to a microsecond.
Time thread_cpu_clock() { return Time(read_clock(CLOCK_THREAD_CPUTIME_ID)); }

/// More than 50 us, because the last readings of a job are closer to each other.
constexpr Duration kBetweenReads = std::chrono::microseconds(60);

}  // namespace

std::int64_t count_primes(std::uint32_t limit) {
  if (limit <= 2) return 2;
  std::int64_t primes = 0;
  for (std::uint32_t candidate = 2; candidate <= limit; ++candidate) {
    primes += smallest_divisor(candidate) == candidate;
    barrier();
  }
  return primes;
}

std::int64_t count_primes_until(Time now, Time until, Duration between_reads, Time (*clock)()) {
  // Larger candidates would take longer than a job may overrun its time.
  constexpr std::uint32_t kLargest = 1024;
  double divisions_per_ns = 0.05;  // a guess that most processors exceed
  std::uint32_t candidate = 2;
  std::int64_t primes = 0;
  while (now < until) {
    const double wanted =
        divisions_per_ns * static_cast<double>(std::min(between_reads, until - now).count());
    std::uint64_t divisions = 0;
    do {
      const std::uint32_t smallest = smallest_divisor(candidate);
      divisions += smallest - 1;
      primes += smallest == candidate;
      candidate = candidate < kLargest ? candidate + 1 : 2;
      barrier();
    } while (static_cast<double>(divisions) < wanted);
    const Time before = now;
    now = clock();
    if (now > before) {
      divisions_per_ns = static_cast<double>(divisions) / static_cast<double>((now - before).count());
    }
  }
  return primes;
}

std::uint32_t crunch_limit(Duration duration, double divisions_per_us) {
  if (duration <= Duration::zero()) return 0;
  const double wanted = static_cast<double>(duration.count()) / 1000.0 * divisions_per_us;
  const auto too_few = [&](std::uint32_t limit) { return static_cast<double>(divisions_of(limit)) < wanted; };
  std::uint32_t low = 3, high = 4;
  while (too_few(high) && high < (1U << 24)) high *= 2;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    too_few(middle) ? low = middle + 1 : high = middle;
  }
  return low;
}

Calibration calibrate(Duration typical) {
  constexpr unsigned kMaxReadings = 10;
  constexpr int kCrunchesPerReading = 15;
  std::array<Duration, kCrunchesPerReading> durations{};
  // Start with a guess of the speed, then use crunches of the graph's length, because the cost of a
  // division depends on the size of the numbers.
  Calibration calibration;
  calibration.divisions_per_us = 300;
  const Duration length = std::clamp(typical, from_ms(0.5), from_ms(20));
  double previous = 0;
  while (calibration.readings < kMaxReadings) {
    const std::uint32_t limit = crunch_limit(length, calibration.divisions_per_us);
    for (Duration& duration : durations) {
      const Time start = now();
      [[maybe_unused]] volatile std::int64_t primes = count_primes(limit);
      duration = now() - start;
    }
    std::nth_element(durations.begin(), durations.begin() + kCrunchesPerReading / 2, durations.end());
    const Duration typical_duration = durations[kCrunchesPerReading / 2];
    calibration.divisions_per_us =
        static_cast<double>(divisions_of(limit)) * 1000.0 / static_cast<double>(typical_duration.count());
    ++calibration.readings;
    calibration.spread_percent =
        previous == 0 ? 100 : 100 * std::abs(calibration.divisions_per_us - previous) / previous;
    previous = calibration.divisions_per_us;
    if (calibration.spread_percent <= kCalibrationTolerancePercent) return calibration;
  }
  calibration.disturbed = true;
  return calibration;
}

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
