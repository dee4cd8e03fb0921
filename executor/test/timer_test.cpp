// SPDX-License-Identifier: Apache-2.0
// Timer arithmetic of rcl (rcl/src/rcl/timer.c, rolling rule).
#include "hotpath/core/timer.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test {
namespace {

Timer timer(Duration period, Duration phase, Time epoch) {
  TaskSet set;
  set.tasks.resize(3);
  set.tasks.push_back({});
  Task& t = set.tasks.back();
  t.period = period;
  t.phase = phase;
  t.deadline = period / 2;
  return Timer(3, t, epoch);
}

TEST(RclTimer, IsReadyFromItsTimestampOnAndACallThereMovesOnByOnePeriod) {
  Timer t = timer(10ms, 4ms, at(100ms));
  EXPECT_EQ(t.next_call(), at(104ms));
  EXPECT_FALSE(t.is_ready(at(104ms - 1ns)));
  EXPECT_TRUE(t.is_ready(at(104ms)));
  const Job job = t.call(at(104ms));
  EXPECT_EQ(job.task, 3U);
  EXPECT_EQ(job.sequence, 0U);
  EXPECT_EQ(job.timestamp, at(104ms));
  EXPECT_EQ(job.release, at(104ms));
  EXPECT_EQ(job.deadline, at(109ms));
  EXPECT_EQ(job.skipped, 0U);
  EXPECT_EQ(t.next_call(), at(114ms));
}

/// A timestamp equal to the instant of a late call is skipped as well; Humble would keep it.
TEST(RclTimer, EveryTimestampIsReleasedOrSkippedExactlyOnce) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Duration period(uniform(random, 1, 50)), phase(uniform(random, 0, 50));
    Timer t = timer(period, phase, Time{});
    Time now = at(phase);
    std::uint64_t covered = 0;
    for (int calls = 0; calls < 20; ++calls) {
      now = std::max(now, t.next_call()) + Duration(uniform(random, 0, 200));
      const std::uint32_t would_skip = t.would_skip(now);
      const Job job = t.call(now);
      ASSERT_EQ(job.skipped, would_skip);
      ASSERT_EQ(job.sequence, covered);
      ASSERT_EQ(job.timestamp, at(phase) + static_cast<std::int64_t>(covered) * period);
      covered += 1 + job.skipped;
      ASSERT_GT(t.next_call(), now);
      ASSERT_LE(t.next_call() - period, now);
    }
  }
}

}  // namespace
}  // namespace hotpath::test
