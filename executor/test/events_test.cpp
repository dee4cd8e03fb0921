// SPDX-License-Identifier: Apache-2.0
// The stock EventsExecutor (rclcpp 26.0.0 events_executor.cpp, timers_manager.cpp), release-only and
// release-and-execute.
#include "events_fixture.hpp"

namespace hotpath::test {
namespace {

class EventsExecutor : public EventsFixture {};

TEST_F(EventsExecutor, HasAnExecutorAndATimerManagementWorker) {
  start("events-ro");
  ASSERT_EQ(scheduler->workers().size(), 2U);
  EXPECT_EQ(scheduler->workers()[kExecutor], WorkerRole::executor);
  EXPECT_EQ(scheduler->workers()[kReleaser], WorkerRole::timer_management);
}

TEST_F(EventsExecutor, ReleaseOnlyReleasesOneTimerPerTurnAndWakesTheExecutorAfterEach) {
  add_timer(set, 10ms, 0ms);
  add_timer(set, 10ms, 0ms);
  start("events-ro");
  for (int i = 0; i < 2; ++i) {
    const Turn turn = take_turn(*scheduler, kReleaser, at(0ms));
    EXPECT_EQ(turn.released, 1U);
    EXPECT_FALSE(turn.decision.job);
    EXPECT_EQ(turn.decision.wake, WorkerSet::of(kExecutor));
    EXPECT_EQ(turn.decision.wake_at, i == 0 ? at(0ms) : at(10ms));
  }
  const Turn idle = take_turn(*scheduler, kReleaser, at(1ms));
  EXPECT_EQ(idle.released, 0U);
  EXPECT_TRUE(idle.decision.wake.empty());
}

TEST_F(EventsExecutor, ReleaseOnlySkipsOnlyIfTheReleaserItselfIsLateByAPeriod) {
  add_timer(set, 10ms, 0ms);
  start("events-ro");
  take_turn(*scheduler, kReleaser, at(25ms));
  const Job job = *next(kExecutor, 25ms);
  EXPECT_EQ(job.timestamp, at(0ms));
  EXPECT_EQ(job.skipped, 2U);
}

TEST_F(EventsExecutor, ReleaseAndExecuteRunsTheEarliestNextCallInTheTimerThread) {
  const TaskId a = add_timer(set, 100ms, 0ms, 2ms);
  const TaskId b = add_timer(set, 100ms, 0ms, 1ms);
  start("events-re");
  EXPECT_EQ(take_turn(*scheduler, kReleaser, at(0ms)).decision.wake_at, at(1ms));
  EXPECT_FALSE(next(kExecutor, 5ms));
  EXPECT_EQ(next(kReleaser, 5ms)->task, b);
  EXPECT_EQ(next(kReleaser, 5ms)->task, a);
  EXPECT_FALSE(next(kReleaser, 5ms));
}

class EdgeTriggered : public EventsExecutor, public testing::WithParamInterface<const char*> {};

TEST_P(EdgeTriggered, SurplusEventsOfAShallowHistoryFindNothing) {
  const TaskId timer = add_timer(set, 100ms, 0ms, 50ms);
  const TaskId subscription = add_subscription(set, {timer}, 0ms);
  start(GetParam());
  scheduler->sample_arrived(subscription, {at(1ms), kNever, {timer, 0}}, at(1ms));
  const Arrival second = scheduler->sample_arrived(subscription, {at(2ms), kNever, {timer, 1}}, at(2ms));
  ASSERT_TRUE(second.overwritten);
  EXPECT_EQ(second.overwritten->ref(), (JobRef{subscription, 0}));
  EXPECT_EQ(scheduler->unread(subscription), 1U);
  const Job newest = *next(kExecutor, 3ms);
  EXPECT_EQ(newest.sequence, 1U);
  EXPECT_FALSE(newest.empty);
  EXPECT_GE(newest.release, newest.timestamp);
  EXPECT_EQ(scheduler->unread(subscription), 0U);
  EXPECT_TRUE(next(kExecutor, 4ms)->empty);
  EXPECT_FALSE(next(kExecutor, 5ms));
}

INSTANTIATE_TEST_SUITE_P(Registry, EdgeTriggered,
                         testing::Values("events-ro", "events-re", "rm-ro", "rm-re", "edf-ro", "edf-re"),
                         [](const auto& executor) { return identifier(executor.param); });

}  // namespace
}  // namespace hotpath::test
