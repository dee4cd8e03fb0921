// SPDX-License-Identifier: Apache-2.0
// The stock EventsExecutor (rclcpp 26.0.0 events_executor.cpp, timers_manager.cpp), and the paper's
// executors (Section IV, modifications), release-only and release-and-execute. properties.cpp (Section V-A,
// condition C2) and bench/test/independent/ (also Section VI, subscriptions) check whole schedules.
#include <gtest/gtest.h>

#include "hotpath/core/events_scheduler.hpp"
#include "task_sets.hpp"

namespace hotpath::test::events_test {

constexpr Worker kExecutor = EventsScheduler::kExecutor;
constexpr Worker kReleaser = EventsScheduler::kTimerManagement;

/// An events executor for `set` whose workers take turns one at a time.
class EventsExecutor : public testing::Test {
 protected:
  void start(const char* executor, const SchedulerOptions& options = {}) {
    scheduler = find_executor(executor)->make(set, options);
    scheduler->begin(Time{});
  }
  std::optional<Job> next(Worker worker, Duration now) {
    return take_turn(*scheduler, worker, at(now)).decision.job;
  }
  TaskSet set;
  std::unique_ptr<Scheduler> scheduler;
};

TEST_F(EventsExecutor, ReleaseOnlySkipsOnlyIfTheReleaserItselfIsLateByAPeriod) {
  add_timer(set, 10ms, 0ms);
  start("events-ro");
  take_turn(*scheduler, kReleaser, at(25ms));
  const Job job = *next(kExecutor, 25ms);
  EXPECT_EQ(job.timestamp, at(0ms));
  EXPECT_EQ(job.skipped, 2U);
}

TEST_F(EventsExecutor, ATaskThatChangesIsOrderedByThatFromItsNextReleaseOn) {
  const TaskId slow = add_timer(set, 50ms, 0ms);
  const TaskId fast = add_timer(set, 10ms, 0ms);
  const TaskId subscription = add_subscription(set, {}, 0ms);
  start("rm-ro");
  const auto release_all = [&](Duration now) {
    take_turn(*scheduler, kReleaser, at(now));
    scheduler->sample_arrived(subscription, {}, at(now));
  };
  release_all(0ms);  // no task feeds it: last
  for (const TaskId expected : {fast, slow, subscription}) EXPECT_EQ(next(kExecutor, 1ms)->task, expected);
  scheduler->change_task(fast, std::nullopt, {subscription});
  release_all(50ms);  // as urgent as the timer, and before it
  for (const TaskId expected : {subscription, fast, slow}) EXPECT_EQ(next(kExecutor, 51ms)->task, expected);
}

TEST_F(EventsExecutor, SeveralWorkersShareTheQueueAndKeepGroupsApart) {
  const TaskId slow = add_timer(set, 50ms, 0ms);
  const TaskId fast = add_timer(set, 10ms, 0ms);
  const TaskId other = add_timer(set, 90ms, 0ms);
  const TaskId beside = add_timer(set, 95ms, 0ms);
  set.tasks[fast].group = set.tasks[slow].group;
  set.tasks[beside].group = set.tasks[other].group;
  set.groups[set.tasks[other].group] = CallbackGroup::reentrant;
  start("rm-ro", {.release_only_workers = 2});
  constexpr Worker kTimers = 2;
  EXPECT_TRUE(take_turn(*scheduler, kTimers, at(0ms)).decision.wake.contains(1));
  const Job first = *next(0, 0ms);
  EXPECT_EQ(first.task, fast);
  EXPECT_EQ(next(1, 0ms)->task, other);  // `slow` belongs to the busy group
  EXPECT_TRUE(scheduler->finished(0, first, at(1ms)).wake.contains(1));
  const Job second = *next(0, 1ms);
  EXPECT_EQ(second.task, slow);
  scheduler->finished(0, second, at(2ms));
  EXPECT_EQ(next(0, 2ms).value_or(Job{}).task, beside);  // `other`, of its reentrant group, still runs
}

TEST(Registry, EveryExecutorHasTheWorkersOfItsTraits) {
  TaskSet set;
  add_timer(set, 10ms, 1ms);
  for (const ExecutorEntry& executor : executors()) {
    for (const unsigned workers : {0U, 3U}) {
      SchedulerOptions options;
      options.workers = workers;
      EXPECT_EQ(executor.make(set, options)->workers().size(), worker_count(executor, options))
          << executor.name;
    }
  }
}

}  // namespace hotpath::test::events_test
