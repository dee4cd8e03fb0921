// SPDX-License-Identifier: Apache-2.0
// Work in CPU time: how much of it a job does, and how often it reads the clock, in amounts of CPU
// time, which other programs do not change.
#include "hotpath/reference_system/work.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <vector>

#include "hotpath/live/clock.hpp"

namespace hotpath::work_test {

using namespace std::chrono_literals;

std::vector<Time> readings;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

Time counted_cpu_clock() { return readings.emplace_back(read_clock(CLOCK_THREAD_CPUTIME_ID)); }

/// Readings of a job of this length, with the reading at its start.
std::vector<Time> read_in_job(Duration length) {
  readings.clear();
  const Time begin = counted_cpu_clock();
  EXPECT_GT(count_primes_until(begin, begin + length, 60us, counted_cpu_clock), 0);
  return readings;
}

TEST(WorkInCpuTime, DoesWhatIsAskedForAndHardlyMoreAndReadsTheClockAtMostEvery50Microseconds) {
  for (const Duration length : {Duration(20us), Duration(500us), Duration(4200us), Duration(50ms)}) {
    std::vector<Duration> excess;
    std::size_t least = SIZE_MAX;
    Duration of_least{};
    for (int job = 0; job < 20; ++job) {
      const std::vector<Time> all = read_in_job(length);
      if (all.size() < least) least = all.size(), of_least = all.back() - all.front();
      excess.push_back(all.back() - all.front() - length);
      EXPECT_GE(excess.back(), Duration{});
    }
    // A few more at both ends, where the speed is not known yet and little work is left.
    EXPECT_LE(least, of_least / 50us + 4) << to_ms(length);
    // Interrupts and a hypervisor may prolong some jobs.
    std::ranges::nth_element(excess, excess.begin() + 10);
    EXPECT_LE(excess[10], 50us) << to_ms(length);
  }
}

TEST(WorkInCpuTime, WorkThatIsOverReadsNothing) {
  readings.clear();
  EXPECT_EQ(count_primes_until(Time{2ms}, Time{2ms}, 60us, counted_cpu_clock), 0);
  EXPECT_TRUE(readings.empty());
}

int reads = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

/// The primes that are counted from 0 to `until` by a clock that advances by `step_us` at each reading.
template <int step_us>
std::int64_t primes_until(Duration until, Duration between_reads = 60us) {
  reads = 0;
  return count_primes_until(Time{}, Time{until}, between_reads, [] { return Time{++reads * step_us * 1us}; });
}

/// As when a hypervisor withholds the processor and the kernel counts this as the thread's time.
TEST(WorkInCpuTime, StolenTimeCountsAsWork) {
  EXPECT_GT(primes_until<10'000>(4ms), 0);
  EXPECT_EQ(reads, 1);
}

TEST(WorkInCpuTime, LittleIsDoneInTheLittleTimeThatIsLeft) {
  EXPECT_LT(primes_until<50>(101us), primes_until<50>(150us));
}

TEST(Work, ReadsTheWallClockAfterEachCandidate) {
  EXPECT_GT(primes_until<1>(4ms, Duration{}), 0);
  EXPECT_EQ(reads, 4000);
}

TEST(Work, UntilAWallClockInstantCountsFromTheStartOfTheJob) {
  Callback callback;
  callback.worst = 7020ms;
  callback.publishes.emplace_back().at = 0.5;
  const std::vector<WorkPart> parts = parts_of(WorkMode::wall, callback, 0);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].burn(now() - 7s), 0);
  EXPECT_GT(parts[1].burn(now() - 7s), 0);
}

/// Under each mode, a job of 2 ms uses about that much CPU time.
TEST(Work, UsesItsExecutionTime) {
  Callback callback;
  callback.worst = 2ms;
  const auto used = [&](WorkMode mode) {
    const Duration before = read_clock(CLOCK_THREAD_CPUTIME_ID);
    EXPECT_GT(parts_of(mode, callback, 300).at(0).burn(now()), 0);
    return read_clock(CLOCK_THREAD_CPUTIME_ID) - before;
  };
  EXPECT_GE(used(WorkMode::cpu_time), 2ms);
  EXPECT_GT(used(WorkMode::fixed), Duration{});
  EXPECT_GE(used(WorkMode::wall), Duration{});
  EXPECT_EQ((WorkPart{1, WorkMode::cpu_time}).burn(now()), 0) << "no work, no reading";
}

}  // namespace hotpath::work_test
