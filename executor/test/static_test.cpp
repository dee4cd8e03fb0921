// SPDX-License-Identifier: Apache-2.0
// StaticSingleThreadedExecutor (rclcpp 26.0.0 static_single_threaded_executor.cpp).
#include "hotpath/core/static_scheduler.hpp"

#include "one_worker_fixture.hpp"

namespace hotpath::test {
namespace {

using StaticExecutor = OneWorkerFixture<StaticScheduler>;

TEST_F(StaticExecutor, RunsAllThatOneWaitFoundSubscriptionsFirstInCreationOrder) {
  const TaskId t1 = add_timer(set, 100ms, 0ms);
  const TaskId s1 = add_subscription(set, {t1}, 0ms);
  const TaskId t2 = add_timer(set, 10ms, 0ms);
  const TaskId s2 = add_subscription(set, {t1}, 0ms);
  start();
  scheduler->sample_arrived(s2, {}, at(0ms));
  scheduler->sample_arrived(s1, {}, at(0ms));
  EXPECT_EQ(next(0ms), s1);
  EXPECT_EQ(next(1ms), s2);
  EXPECT_EQ(next(2ms), t1);
  EXPECT_EQ(next(3ms), t2);
  EXPECT_EQ(job->release, at(0ms));
  EXPECT_EQ(next(4ms), kNoTask);
}

TEST_F(StaticExecutor, WhatBecomesReadyDuringThePassWaitsForTheNextWait) {
  const TaskId late = add_timer(set, 100ms, 0ms, 1ms);
  const TaskId t1 = add_timer(set, 100ms, 0ms);
  const TaskId t2 = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {t1}, 0ms);
  start();
  EXPECT_EQ(next(0ms), t1);
  scheduler->sample_arrived(subscription, {}, at(5ms));
  EXPECT_EQ(next(5ms), t2);
  EXPECT_EQ(next(6ms), subscription);
  EXPECT_EQ(next(7ms), late);
}

TEST_F(StaticExecutor, CallsALateTimerAtItsTurnAndSkips) {
  const TaskId blocking = add_timer(set, 100ms, 0ms);
  const TaskId frequent = add_timer(set, 10ms, 0ms);
  start();
  EXPECT_EQ(next(0ms), blocking);
  EXPECT_EQ(next(35ms), frequent);
  EXPECT_EQ(job->skipped, 3U);
  EXPECT_EQ(next(36ms), kNoTask);
}

TEST_F(StaticExecutor, TakesOneSamplePerReadySubscriptionAndPass) {
  const TaskId timer = add_timer(set, 100ms, 0ms);
  const TaskId deep = add_subscription(set, {timer}, 0ms, 3);
  start();
  scheduler->sample_arrived(deep, {}, at(0ms));
  scheduler->sample_arrived(deep, {}, at(0ms));
  EXPECT_EQ(next(0ms), deep);
  EXPECT_EQ(next(1ms), timer);
  EXPECT_EQ(next(2ms), deep);
  EXPECT_EQ(job->sequence, 1U);
}

TEST_F(StaticExecutor, SampleThatReplacesAReadyOneIsNotReleasedBeforeItsPublication) {
  const TaskId timer = add_timer(set, 100ms, 0ms, 50ms);
  const TaskId first = add_subscription(set, {timer}, 0ms);
  const TaskId second = add_subscription(set, {timer}, 0ms);
  start();
  scheduler->sample_arrived(first, {at(0ms), kNever, {}}, at(0ms));
  scheduler->sample_arrived(second, {at(0ms), kNever, {}}, at(0ms));
  EXPECT_EQ(next(0ms), first);
  scheduler->sample_arrived(second, {at(3ms), kNever, {}}, at(3ms));
  EXPECT_EQ(next(4ms), second);
  EXPECT_EQ(job->timestamp, at(3ms));
  EXPECT_EQ(job->release, at(3ms));
}

TEST_F(StaticExecutor, SleepsUntilTheEarliestTimerOrASample) {
  add_timer(set, 100ms, 0ms, 30ms);
  add_timer(set, 100ms, 0ms, 20ms);
  const TaskId subscription = add_subscription(set, {0}, 0ms);
  start();
  EXPECT_EQ(scheduler->decide(0, at(1ms)).wake_at, at(20ms));
  EXPECT_EQ(scheduler->sample_arrived(subscription, {}, at(2ms)).wake, WorkerSet::of(0));
}

TEST(StaticExecutorSimulated, IgnoresCallbackGroupsAndRunsOnOneWorker) {
  TaskSet set;
  add_timer(set, 20ms, 5ms);
  add_timer(set, 20ms, 5ms);
  set.tasks[1].group = set.tasks[0].group;
  EXPECT_EQ(schedule(run(set, "static", 20ms)), (std::vector<Ran>{{0, 0, 0ms, 5ms}, {1, 0, 5ms, 10ms}}));
}

}  // namespace
}  // namespace hotpath::test
