// SPDX-License-Identifier: Apache-2.0
// StaticSingleThreadedExecutor (rclcpp 26.0.0 static_single_threaded_executor.cpp): what its schedules do
// not show, which bench/test/independent/ checks.
#include "hotpath/core/static_scheduler.hpp"

#include "one_worker_fixture.hpp"

namespace hotpath::test {
namespace {

using StaticExecutor = OneWorkerFixture<StaticScheduler>;

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

}  // namespace
}  // namespace hotpath::test
