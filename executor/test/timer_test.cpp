// SPDX-License-Identifier: Apache-2.0
// Timer arithmetic of rcl (rcl/src/rcl/timer.c, rolling rule), and the timer release queue (rclcpp
// timers_manager.hpp; paper, Section III).
#include "hotpath/core/timer.hpp"

#include <gtest/gtest.h>

#include "hotpath/core/timers_manager.hpp"
#include "task_sets.hpp"

namespace hotpath::test::timer_test {
namespace {

Timer timer(Duration period, Duration phase, Time epoch) {
  Task t;
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

TEST(TimersManager, ReleasesAllTimestampsOfRandomTimersInOrder) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const TaskSet set = random_timers(random, static_cast<int>(uniform(random, 1, 40)), 0.5);
    std::vector<std::pair<Time, TaskId>> expected, released;
    for (TaskId id = 0; id < set.size(); ++id) {
      for (Duration t = set[id].phase; t < 500ms; t += set[id].period) expected.emplace_back(at(t), id);
    }
    std::sort(expected.begin(), expected.end());
    TimersManager manager;
    manager.begin(set, Time{});
    while (manager.next_due() < at(500ms)) {
      const Job job = manager.call_head(manager.next_due());
      released.emplace_back(job.timestamp, job.task);
    }
    ASSERT_EQ(released, expected);
  }
}

}  // namespace
}  // namespace hotpath::test::timer_test
