// SPDX-License-Identifier: Apache-2.0
// EventsCBGExecutor (cm_executors: events_cbg_executor.cpp, FirstInFirstOutScheduler.cpp, timer_manager.hpp).
#include "hotpath/core/callback_group_scheduler.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test::callback_group_test {
namespace {

class CallbackGroupExecutor : public testing::Test {
 protected:
  void start(unsigned workers = 1) {
    scheduler = std::make_unique<CallbackGroupScheduler>(set, workers);
    manager = workers;
    scheduler->begin(Time{});
  }
  WorkerSet release(Duration now) { return scheduler->release_timers(manager, at(now)).wake; }
  std::optional<Job> decide(Worker worker, Duration now) { return scheduler->decide(worker, at(now)).job; }

  TaskSet set;
  Worker manager = 1;
  std::unique_ptr<CallbackGroupScheduler> scheduler;
};

TEST_F(CallbackGroupExecutor, GroupsQueueUpInTheOrderInWhichTheyBecameReady) {
  const TaskId late = add_timer(set, 100ms, 0ms, 2ms);
  const TaskId early = add_timer(set, 100ms, 0ms, 1ms);
  const TaskId subscription = add_subscription(set, {early}, 0ms);
  start();
  scheduler->sample_arrived(subscription, {}, at(0ms));
  release(2ms);
  for (const TaskId expected : {subscription, early, late}) {
    const Job job = *decide(0, 2ms);
    EXPECT_EQ(job.task, expected);
    scheduler->finished(0, job, at(2ms));
  }
  EXPECT_FALSE(decide(0, 2ms));
}

TEST_F(CallbackGroupExecutor, ATimerIsCalledWhenItStartsAndReturnsToTheManagerWhenItHasRun) {
  const TaskId timer = add_timer(set, 10ms, 0ms);
  start();
  release(0ms);
  release(35ms);  // not in the timer manager: nothing to release
  const Job job = *decide(0, 35ms);
  EXPECT_EQ(job.ref(), (JobRef{timer, 0}));
  EXPECT_EQ(job.skipped, 3U);
  EXPECT_EQ(job.release, at(0ms));
  EXPECT_EQ(scheduler->decide(manager, at(36ms)).wake_at, kNever);
  EXPECT_EQ(scheduler->finished(0, job, at(38ms)).wake, WorkerSet::of(manager));
  EXPECT_EQ(scheduler->decide(manager, at(38ms)).wake_at, at(40ms));
}

TEST_F(CallbackGroupExecutor, NotEvenAReentrantGroupRunsTwoEventsAtOnce) {
  const TaskId timer = add_timer(set, 100ms, 0ms, 50ms);
  const TaskId subscription = add_subscription(set, {timer}, 0ms, 5);
  set.groups[set.tasks[subscription].group] = CallbackGroup::reentrant;
  start(2);
  scheduler->sample_arrived(subscription, {}, at(0ms));
  scheduler->sample_arrived(subscription, {}, at(0ms));
  EXPECT_TRUE(decide(0, 1ms));
  EXPECT_FALSE(decide(1, 1ms));
}

TEST_F(CallbackGroupExecutor, EachReadyGroupWakesAnotherIdleWorker) {
  add_timer(set, 100ms, 0ms, 5ms);
  add_timer(set, 100ms, 0ms, 5ms);
  start(3);
  for (const Worker w : {0U, 1U, 2U}) EXPECT_FALSE(decide(w, 0ms));
  WorkerSet both = WorkerSet::of(0);
  both.insert(1);
  EXPECT_EQ(release(5ms), both);
  EXPECT_TRUE(decide(1, 5ms));
  EXPECT_TRUE(decide(0, 5ms));
}

}  // namespace
}  // namespace hotpath::test::callback_group_test
