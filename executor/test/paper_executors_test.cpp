// SPDX-License-Identifier: Apache-2.0
// The paper's executors: Section IV (modifications). properties.cpp (Section V-A, condition C2, and
// Section VI, subscriptions) and bench/test/independent/ check whole schedules.
#include "events_fixture.hpp"

namespace hotpath::test {
namespace {

class PaperExecutor : public EventsFixture {};

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
  set.tasks[fast].group = set.tasks[slow].group;
  scheduler = find_executor("rm-ro")->make(set, {.release_only_workers = 2});
  scheduler->begin(Time{});
  constexpr Worker kTimers = 2;
  EXPECT_TRUE(take_turn(*scheduler, kTimers, at(0ms)).decision.wake.contains(1));
  const Job first = *next(0, 0ms);
  EXPECT_EQ(first.task, fast);
  EXPECT_EQ(next(1, 0ms)->task, other);  // `slow` belongs to the busy group
  EXPECT_TRUE(scheduler->finished(0, first, at(1ms)).wake.contains(1));
  EXPECT_EQ(next(0, 1ms)->task, slow);
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
}  // namespace hotpath::test
