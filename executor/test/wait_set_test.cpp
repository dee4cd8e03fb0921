// SPDX-License-Identifier: Apache-2.0
// SingleThreadedExecutor, StaticSingleThreadedExecutor and MultiThreadedExecutor (rclcpp 26.0.0
// executor.cpp, allocator_memory_strategy.hpp, static_single_threaded_executor.cpp,
// multi_threaded_executor.cpp), and MultiThreadedExecutor from rclcpp 28 on: what the schedules that
// bench/test/independent/ checks do not show.
#include "hotpath/core/wait_set_scheduler.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test::wait_set_test {

/// The decision at the end of the wait, if one begins that has something to find.
Decision decide(WaitSetScheduler& scheduler, Worker worker, Duration now) {
  const Decision decision = scheduler.decide(worker, at(now));
  const bool finds = !decision.job && decision.wake_at <= at(now);
  return finds ? scheduler.decide(worker, at(now)) : decision;
}

TEST(SingleThreadedExecutors, SampleThatReplacesAReadyOneIsNotReleasedBeforeItsPublication) {
  for (const char* executor : {"default", "static"}) {
    TaskSet set;
    const TaskId timer = add_timer(set, 100ms, 0ms, 50ms);
    const TaskId first = add_subscription(set, {timer}, 0ms);
    const TaskId second = add_subscription(set, {timer}, 0ms);
    const auto scheduler = find_executor(executor)->make(set, {});
    scheduler->begin(Time{});
    for (const TaskId id : {first, second}) scheduler->sample_arrived(id, {at(0ms), kNever, {}}, at(0ms));
    const Job ran = scheduler->decide(0, at(0ms)).job.value();
    EXPECT_EQ(ran.task, first);
    scheduler->finished(0, ran, at(0ms));
    scheduler->sample_arrived(second, {at(3ms), kNever, {}}, at(3ms));
    const Job job = scheduler->decide(0, at(4ms)).job.value();
    EXPECT_EQ(job.task, second);
    EXPECT_EQ(job.timestamp, at(3ms));
    EXPECT_EQ(job.release, at(3ms));
  }
}

TEST(MultiThreadedExecutor, AWaitFindsWhatArrivesBeforeItsEnd) {
  TaskSet set;
  const TaskId a = add_timer(set, 100ms, 0ms, 50ms);
  const TaskId first = add_subscription(set, {a}, 0ms);
  const TaskId second = add_subscription(set, {a}, 0ms);
  WaitSetScheduler scheduler(set, 2U);
  scheduler.begin(Time{});
  scheduler.sample_arrived(second, {}, at(1ms));
  const Decision begun = scheduler.decide(0, at(1ms));
  EXPECT_FALSE(begun.job);
  EXPECT_EQ(begun.wake_at, at(1ms));
  EXPECT_EQ(begun.waited_for, 3U);
  scheduler.sample_arrived(first, {}, at(2ms));
  EXPECT_EQ(scheduler.decide(0, at(2ms)).job->task, first);
}

TEST(MultiThreadedExecutor, TheSleepingWorkerDecidesBeforeTheOneThatEndsAJob) {
  TaskSet set;
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {a}, 0ms);
  WaitSetScheduler scheduler(set, 2U);
  scheduler.begin(Time{});
  const Job running = decide(scheduler, 0, 0ms).job.value();
  EXPECT_FALSE(decide(scheduler, 1, 1ms).job);
  EXPECT_EQ(scheduler.sample_arrived(subscription, {}, at(4ms)).wake, WorkerSet::of(1));
  EXPECT_EQ(scheduler.finished(0, running, at(4ms)).wake, WorkerSet::of(1));
  const Decision ending = decide(scheduler, 0, 4ms);
  EXPECT_FALSE(ending.job);
  EXPECT_TRUE(ending.blocked);
  const Decision decision = decide(scheduler, 1, 5ms);
  EXPECT_EQ(decision.job.value().task, subscription);
  EXPECT_EQ(decision.wake, WorkerSet::of(0));
}

TEST(MultiThreadedExecutor, AWaitLeavesOutGroupsThatWereBusyAtItsBeginning) {
  TaskSet set;
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {a}, 0ms);
  set.tasks[subscription].group = set.tasks[a].group;
  WaitSetScheduler scheduler(set, 2U);
  scheduler.begin(Time{});
  const Job running = decide(scheduler, 0, 0ms).job.value();
  EXPECT_FALSE(decide(scheduler, 1, 1ms).job);
  EXPECT_TRUE(scheduler.sample_arrived(subscription, {}, at(2ms)).wake.empty());
  scheduler.finished(0, running, at(3ms));
  EXPECT_EQ(decide(scheduler, 1, 3ms).job.value().task, subscription);  // of a second wait
}

TEST(MultiThreadedExecutor, TheRemedyKeepsBlockedTasksAheadOfTasksFoundLater) {
  TaskSet set;
  const TaskId a = add_timer(set, 10ms, 0ms);
  const TaskId b = add_timer(set, 100ms, 0ms);
  set.tasks[b].group = set.tasks[a].group;
  for (const Blocked blocked : {Blocked::forgotten, Blocked::kept}) {
    WaitSetScheduler scheduler(set, 2U, blocked);
    scheduler.begin(Time{});
    const Job running = decide(scheduler, 0, 0ms).job.value();
    EXPECT_EQ(running.task, a);
    EXPECT_FALSE(decide(scheduler, 1, 1ms).job);  // polls: b stays, or is forgotten
    scheduler.finished(0, running, at(10ms));     // a is due again
    EXPECT_EQ(decide(scheduler, 1, 10ms).job.value().task, blocked == Blocked::kept ? b : a);
  }
}

TEST(RebuiltWaitSet, OnlyTheWorkerThatWaitsPaysForTheWait) {
  TaskSet set;
  add_timer(set, 100ms, 0ms, 50ms);
  RebuiltWaitSetScheduler scheduler(set, 2U);
  scheduler.begin(Time{});
  EXPECT_EQ(scheduler.decide(0, at(0ms)).waited_for, 1U);
  EXPECT_EQ(scheduler.decide(1, at(0ms)).waited_for, 0U);
}

}  // namespace hotpath::test::wait_set_test
