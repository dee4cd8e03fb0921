// SPDX-License-Identifier: Apache-2.0
// SingleThreadedExecutor, StaticSingleThreadedExecutor and MultiThreadedExecutor (rclcpp 26.0.0
// executor.cpp, allocator_memory_strategy.hpp, static_single_threaded_executor.cpp,
// multi_threaded_executor.cpp), and MultiThreadedExecutor from rclcpp 28 on: what schedules on one
// thread do not show, which bench/test/independent/ checks.
#include "hotpath/core/wait_set_scheduler.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test::wait_set_test {
namespace {

/// A scheduler for `set`.
template <class TheScheduler>
class WaitSetFixture : public testing::Test {
 protected:
  void start(auto... arguments) {
    scheduler = std::make_unique<TheScheduler>(set, arguments...);
    scheduler->begin(Time{});
  }
  TaskSet set;
  std::unique_ptr<TheScheduler> scheduler;
};

/// The executors of one thread: a picked job finishes before the next call.
class SingleThreadedExecutor : public WaitSetFixture<Scheduler>,
                               public testing::WithParamInterface<const char*> {
 protected:
  void start() {
    scheduler = find_executor(GetParam())->make(set, {});
    scheduler->begin(Time{});
  }
  /// The task that runs next at `now`, or kNoTask; its job takes no time.
  TaskId next(Duration now) {
    job = scheduler->decide(0, at(now)).job;
    if (!job) return kNoTask;
    scheduler->finished(0, *job, at(now));
    return job->task;
  }
  std::optional<Job> job;
};

INSTANTIATE_TEST_SUITE_P(Registry, SingleThreadedExecutor, testing::Values("default", "static"));

TEST_P(SingleThreadedExecutor, SampleThatReplacesAReadyOneIsNotReleasedBeforeItsPublication) {
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

TEST_P(SingleThreadedExecutor, OffersKindByKindWhateverWasCreatedFirst) {
  const TaskId timer = add_timer(set, 100ms, 0ms);
  const auto add = [&](EntityKind kind) {
    const TaskId id = add_subscription(set, {timer}, 0ms);
    set.tasks[id].entity = kind;
    return id;
  };
  const TaskId waitable = add(EntityKind::waitable), client = add(EntityKind::client),
               service = add(EntityKind::service), subscription = add(EntityKind::subscription);
  start();
  for (const TaskId id : {service, waitable, subscription, client})
    scheduler->sample_arrived(id, {}, at(0ms));
  std::vector<TaskId> order = {timer, subscription, service, client, waitable};
  if (GetParam() == std::string("static")) order = {subscription, timer, client, service, waitable};
  for (const TaskId id : order) EXPECT_EQ(next(0ms), id);
}

TEST_P(SingleThreadedExecutor, SleepsUntilTheEarliestTimerOrASample) {
  add_timer(set, 100ms, 0ms, 30ms);
  add_timer(set, 100ms, 0ms, 20ms);
  const TaskId subscription = add_subscription(set, {0}, 0ms);
  start();
  EXPECT_EQ(scheduler->decide(0, at(1ms)).wake_at, at(20ms));
  EXPECT_EQ(scheduler->sample_arrived(subscription, {}, at(2ms)).wake, WorkerSet::of(0));
  EXPECT_EQ(next(2ms), subscription);
  const bool unheard = scheduler->sample_arrived(subscription, {}, at(3ms)).wake.empty();
  EXPECT_EQ(unheard, GetParam() == std::string("default"));  // no worker waits
}

class MultiThreadedExecutor : public WaitSetFixture<WaitSetScheduler> {
 protected:
  /// The decision at the end of the wait, if one begins that has something to find.
  Decision decide(Worker worker, Duration now) {
    const Decision decision = scheduler->decide(worker, at(now));
    const bool finds = !decision.job && decision.wake_at <= at(now);
    return finds ? scheduler->decide(worker, at(now)) : decision;
  }
};

TEST_F(MultiThreadedExecutor, WorkersShareOneSnapshot) {
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId b = add_timer(set, 100ms, 0ms);
  const TaskId c = add_timer(set, 100ms, 0ms, 1ms);
  start(2U);
  EXPECT_EQ(decide(0, 0ms).job->task, a);
  const Job second = *decide(1, 2ms).job;
  EXPECT_EQ(second.task, b);
  EXPECT_EQ(second.release, at(0ms));  // from worker 0's polling point
  scheduler->finished(1, second, at(3ms));
  EXPECT_EQ(decide(1, 3ms).job->task, c);
}

TEST_F(MultiThreadedExecutor, MutuallyExclusiveGroupRunsOneJobAtATime) {
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId b = add_timer(set, 100ms, 0ms);
  set.tasks[b].group = set.tasks[a].group;
  start(2U);
  const Job running = *decide(0, 0ms).job;
  EXPECT_EQ(running.task, a);
  const Decision blocked = decide(1, 1ms);
  EXPECT_FALSE(blocked.job);
  EXPECT_EQ(blocked.wake_at, kNever);  // the wait leaves out busy groups
  const Effect effect = scheduler->finished(0, running, at(9ms));
  EXPECT_EQ(effect.wake, WorkerSet::of(1));  // the interrupt guard condition
  EXPECT_EQ(decide(1, 9ms).job->task, b);
}

TEST_F(MultiThreadedExecutor, ReentrantGroupRunsSeveralJobsEvenOfOneTimer) {
  const TaskId a = add_timer(set, 10ms, 0ms);
  set.groups[set.tasks[a].group] = CallbackGroup::reentrant;
  start(2U);
  EXPECT_EQ(decide(0, 0ms).job->sequence, 0U);
  EXPECT_EQ(decide(1, 10ms).job->sequence, 1U);
}

TEST_F(MultiThreadedExecutor, OnlyOneIdleWorkerWaitsAndHandsTheWaitOn) {
  const TaskId a = add_timer(set, 100ms, 0ms, 10ms);
  start(3U);
  EXPECT_EQ(decide(0, 0ms).wake_at, at(10ms));
  EXPECT_EQ(decide(1, 0ms).wake_at, kNever);  // queues on the wait mutex
  const Decision decision = decide(0, 10ms);
  EXPECT_EQ(decision.job->task, a);
  EXPECT_EQ(decision.wake, WorkerSet::of(1));
  EXPECT_FALSE(decide(1, 10ms).job);
}

TEST_F(MultiThreadedExecutor, TheSleepingWorkerDecidesBeforeTheOneThatEndsAJob) {
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {a}, 0ms);
  start(2U);
  const Job running = *decide(0, 0ms).job;
  EXPECT_FALSE(decide(1, 1ms).job);
  EXPECT_EQ(scheduler->sample_arrived(subscription, {}, at(4ms)).wake, WorkerSet::of(1));
  EXPECT_EQ(scheduler->finished(0, running, at(4ms)).wake, WorkerSet::of(1));
  const Decision ending = decide(0, 4ms);
  EXPECT_FALSE(ending.job);
  EXPECT_TRUE(ending.blocked);
  const Decision decision = decide(1, 5ms);
  EXPECT_EQ(decision.job->task, subscription);
  EXPECT_EQ(decision.wake, WorkerSet::of(0));
}

TEST_F(MultiThreadedExecutor, AWaitFindsWhatArrivesBeforeItsEnd) {
  const TaskId a = add_timer(set, 100ms, 0ms, 50ms);
  const TaskId first = add_subscription(set, {a}, 0ms);
  const TaskId second = add_subscription(set, {a}, 0ms);
  start(2U);
  scheduler->sample_arrived(second, {}, at(1ms));
  const Decision begun = scheduler->decide(0, at(1ms));
  EXPECT_FALSE(begun.job);
  EXPECT_EQ(begun.wake_at, at(1ms));
  EXPECT_EQ(begun.waited_for, 3U);
  scheduler->sample_arrived(first, {}, at(2ms));
  EXPECT_EQ(scheduler->decide(0, at(2ms)).job->task, first);
}

TEST_F(MultiThreadedExecutor, AWaitLeavesOutGroupsThatWereBusyAtItsBeginning) {
  const TaskId a = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {a}, 0ms);
  set.tasks[subscription].group = set.tasks[a].group;
  start(2U);
  const Job running = *decide(0, 0ms).job;
  EXPECT_FALSE(decide(1, 1ms).job);
  EXPECT_TRUE(scheduler->sample_arrived(subscription, {}, at(2ms)).wake.empty());
  scheduler->finished(0, running, at(3ms));
  EXPECT_EQ(decide(1, 3ms).job->task, subscription);  // of a second wait
}

TEST_F(MultiThreadedExecutor, TheRemedyKeepsBlockedTasksAheadOfTasksFoundLater) {
  const TaskId a = add_timer(set, 10ms, 0ms);
  const TaskId b = add_timer(set, 100ms, 0ms);
  set.tasks[b].group = set.tasks[a].group;
  for (const Blocked blocked : {Blocked::forgotten, Blocked::kept}) {
    start(2U, blocked);
    const Job running = *decide(0, 0ms).job;
    EXPECT_EQ(running.task, a);
    EXPECT_FALSE(decide(1, 1ms).job);           // polls: b stays, or is forgotten
    scheduler->finished(0, running, at(10ms));  // a is due again
    EXPECT_EQ(decide(1, 10ms).job->task, blocked == Blocked::kept ? b : a);
  }
}

class RebuiltWaitSet : public WaitSetFixture<RebuiltWaitSetScheduler> {};

TEST_F(RebuiltWaitSet, AGroupThatWasBusyAtARebuildGoesToTheEnd) {
  for (int i = 0; i < 3; ++i) add_timer(set, 10ms, 0ms);
  start(3U);
  std::vector<Job> jobs;
  for (const Worker w : {0U, 1U, 2U}) jobs.push_back(*scheduler->decide(w, at(0ms)).job);
  EXPECT_EQ(jobs[0].task, 0U);
  scheduler->finished(2, jobs[2], at(2ms));
  EXPECT_FALSE(scheduler->decide(2, at(2ms)).job);  // rebuilt without 0 and 1
  for (const Worker w : {0U, 1U}) scheduler->finished(w, jobs[w], at(3ms));
  for (const Worker w : {2U, 1U, 0U}) EXPECT_FALSE(scheduler->decide(w, at(3ms)).job);  // rebuilt: 2, 1, 0
  for (const Worker w : {2U, 1U, 0U}) EXPECT_EQ(scheduler->decide(w, at(10ms)).job->task, w);
}

TEST_F(RebuiltWaitSet, OnlyTheWorkerThatWaitsPaysForTheWait) {
  add_timer(set, 100ms, 0ms, 50ms);
  start(2U);
  EXPECT_EQ(scheduler->decide(0, at(0ms)).waited_for, 1U);
  EXPECT_EQ(scheduler->decide(1, at(0ms)).waited_for, 0U);
}

TEST_F(RebuiltWaitSet, OfTheSnapshotABlockedTimerStaysAndABlockedSubscriptionDoesNot) {
  const TaskId blocking = add_timer(set, 100ms, 0ms);
  const TaskId timer = add_timer(set, 100ms, 0ms);
  const TaskId blocked = add_subscription(set, {timer}, 0ms);
  const TaskId other = add_subscription(set, {timer}, 0ms);
  set.tasks[timer].group = set.tasks[blocked].group = set.tasks[blocking].group;
  start(2U);
  scheduler->sample_arrived(blocked, {}, at(0ms));
  scheduler->sample_arrived(other, {}, at(0ms));
  const Job running = *scheduler->decide(0, at(0ms)).job;
  EXPECT_EQ(running.task, blocking);
  const Job beside = *scheduler->decide(1, at(1ms)).job;
  EXPECT_EQ(beside.task, other);  // saw `timer`, which stays, and `blocked`, which is dropped
  scheduler->finished(0, running, at(2ms));
  const Job from_snapshot = *scheduler->decide(0, at(2ms)).job;
  EXPECT_EQ(from_snapshot.task, timer);
  EXPECT_EQ(from_snapshot.release, at(0ms));
  scheduler->finished(0, from_snapshot, at(3ms));
  const Job from_next_poll = *scheduler->decide(0, at(3ms)).job;
  EXPECT_EQ(from_next_poll.task, blocked);
  EXPECT_EQ(from_next_poll.release, at(3ms));
}

}  // namespace
}  // namespace hotpath::test::wait_set_test
