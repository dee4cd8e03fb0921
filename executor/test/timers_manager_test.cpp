// SPDX-License-Identifier: Apache-2.0
// The timer release queue (rclcpp timers_manager.hpp; paper, Section III).
#include "hotpath/core/timers_manager.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test {
namespace {

TEST(TimersManager, WithoutTimersItIsNeverDue) {
  TaskSet set;
  TimersManager manager;
  manager.begin(set, Time{});
  EXPECT_EQ(manager.next_due(), kNever);
  EXPECT_FALSE(manager.due(at(1000h)));
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
}  // namespace hotpath::test
