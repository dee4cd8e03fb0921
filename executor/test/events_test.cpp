// SPDX-License-Identifier: Apache-2.0
// The stock EventsExecutor (rclcpp 26.0.0 events_executor.cpp, timers_manager.cpp), and the paper's
// executors (Section IV, modifications), release-only and release-and-execute. properties.cpp (Section V-A,
// condition C2, and Section VI, subscriptions) and bench/test/independent/ check whole schedules.
#include <gtest/gtest.h>

#include "hotpath/core/events_scheduler.hpp"
#include "task_sets.hpp"

namespace hotpath::test::events_test {
namespace {

constexpr Worker kExecutor = EventsScheduler::kExecutor;
constexpr Worker kReleaser = EventsScheduler::kTimerManagement;

/// An events executor for `set` whose workers take turns one at a time.
class EventsExecutor : public testing::Test {
 protected:
  void start(const char* executor) {
    scheduler = find_executor(executor)->make(set, {});
    scheduler->begin(Time{});
  }
  std::optional<Job> next(Worker worker, Duration now) {
    return take_turn(*scheduler, worker, at(now)).decision.job;
  }
  TaskSet set;
  std::unique_ptr<Scheduler> scheduler;
};
class PaperExecutor : public EventsExecutor {};

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

TEST_F(PaperExecutor, SectionIVReleaseOnlyReleasesAllDueTimersUnderOneLockWithOneWakeUp) {
  for (int i = 0; i < 3; ++i) add_timer(set, 10ms * (3 - i), 0ms);
  start("rm-ro");
  const Turn turn = take_turn(*scheduler, kReleaser, at(0ms));
  EXPECT_EQ(turn.released, 3U);
  EXPECT_EQ(turn.decision.wake, WorkerSet::of(kExecutor));
  EXPECT_FALSE(turn.decision.job);
  EXPECT_EQ(turn.decision.wake_at, at(10ms));
  for (const TaskId expected : {2U, 1U, 0U}) EXPECT_EQ(next(kExecutor, 1ms)->task, expected);
}

TEST_F(PaperExecutor, SectionIVReleaseAndExecuteKeepsTimersInAReadyQueueOfItsOwn) {
  const TaskId slow = add_timer(set, 50ms, 0ms);
  const TaskId fast = add_timer(set, 10ms, 0ms);
  start("rm-re");
  const Turn turn = take_turn(*scheduler, kReleaser, at(0ms));
  EXPECT_EQ(turn.released, 2U);
  EXPECT_TRUE(turn.decision.wake.empty());
  EXPECT_EQ(turn.decision.job->task, fast);
  EXPECT_FALSE(next(kExecutor, 1ms));  // timers never reach the executor worker
  EXPECT_EQ(next(kReleaser, 1ms)->task, slow);
}

TEST_F(PaperExecutor, ATaskThatChangesIsOrderedByThatFromItsNextReleaseOn) {
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

TEST_F(PaperExecutor, SeveralWorkersShareTheQueueAndKeepGroupsApart) {
  const TaskId slow = add_timer(set, 50ms, 0ms);
  const TaskId fast = add_timer(set, 10ms, 0ms);
  const TaskId other = add_timer(set, 90ms, 0ms);
  const TaskId beside = add_timer(set, 95ms, 0ms);
  set.tasks[fast].group = set.tasks[slow].group;
  set.tasks[beside].group = set.tasks[other].group;
  set.groups[set.tasks[other].group] = CallbackGroup::reentrant;
  scheduler = find_executor("rm-ro")->make(set, {.release_only_workers = 2});
  scheduler->begin(Time{});
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

}  // namespace
}  // namespace hotpath::test::events_test
