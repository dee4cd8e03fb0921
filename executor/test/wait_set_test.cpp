// SPDX-License-Identifier: Apache-2.0
// SingleThreadedExecutor and MultiThreadedExecutor (rclcpp 26.0.0 executor.cpp,
// allocator_memory_strategy.hpp, multi_threaded_executor.cpp), and MultiThreadedExecutor from
// rclcpp 28 on.
#include "hotpath/core/wait_set_scheduler.hpp"

#include "hotpath/core/rebuilt_wait_set_scheduler.hpp"
#include "one_worker_fixture.hpp"

namespace hotpath::test {
namespace {

class SingleThreadedExecutor : public OneWorkerFixture<WaitSetScheduler> {
 protected:
  WaitSetScheduler& start(unsigned workers = 1) { return OneWorkerFixture::start(workers); }
};

TEST_F(SingleThreadedExecutor, WhatBecomesReadyAfterThePollingPointWaitsForTheNextOne) {
  const TaskId late = add_timer(set, 100ms, 0ms, 1ms);
  const TaskId first = add_timer(set, 100ms, 0ms);
  const TaskId second = add_timer(set, 100ms, 0ms);
  const TaskId subscription = add_subscription(set, {first}, 0ms);
  start();
  EXPECT_EQ(next(0ms), first);  // polling point at 0
  scheduler->sample_arrived(subscription, {}, at(5ms));
  EXPECT_EQ(next(5ms), second);  // `late` is due and was created earlier, but is not in the window
  EXPECT_EQ(job->release, at(0ms));
  EXPECT_EQ(next(6ms), late);  // next polling point
  EXPECT_EQ(job->release, at(6ms));
  EXPECT_EQ(next(7ms), subscription);
  EXPECT_EQ(job->release, at(6ms));
}

TEST_F(SingleThreadedExecutor, SampleThatReplacesTheSnapshotsOneIsNotReleasedBeforeItsPublication) {
  const TaskId timer = add_timer(set, 10ms, 0ms);
  const TaskId subscription = add_subscription(set, {timer}, 0ms);
  start();
  scheduler->sample_arrived(subscription, {at(0ms), kNever, {}}, at(0ms));
  EXPECT_EQ(next(0ms), timer);
  scheduler->sample_arrived(subscription, {at(4ms), kNever, {}}, at(4ms));
  EXPECT_EQ(next(5ms), subscription);
  EXPECT_EQ(job->timestamp, at(4ms));
  EXPECT_EQ(job->release, at(4ms));
}

TEST_F(SingleThreadedExecutor, SleepsUntilTheEarliestTimerOrASample) {
  add_timer(set, 100ms, 0ms, 30ms);
  add_timer(set, 100ms, 0ms, 20ms);
  const TaskId subscription = add_subscription(set, {0}, 0ms);
  start();
  EXPECT_EQ(scheduler->decide(0, at(1ms)).wake_at, at(20ms));
  EXPECT_EQ(scheduler->sample_arrived(subscription, {}, at(2ms)).wake, WorkerSet::of(0));
  EXPECT_EQ(next(2ms), subscription);
  EXPECT_TRUE(scheduler->sample_arrived(subscription, {}, at(3ms)).wake.empty());  // no worker waits
}

TEST_F(SingleThreadedExecutor, UnfinishedNamesWhatIsDueAndWhatIsUnread) {
  add_timer(set, 10ms, 0ms);
  const TaskId subscription = add_subscription(set, {0}, 0ms, 2);
  start();
  scheduler->sample_arrived(subscription, {}, at(0ms));
  scheduler->sample_arrived(subscription, {}, at(0ms));
  std::vector<std::pair<JobRef, std::uint32_t>> left;
  scheduler->unfinished(at(25ms), [&](const Job& j, Outcome o) {
    EXPECT_EQ(o, Outcome::queued);
    left.emplace_back(j.ref(), j.skipped);
  });
  EXPECT_EQ(left, (std::vector<std::pair<JobRef, std::uint32_t>>{
                      {{0, 0}, 2}, {{subscription, 0}, 0}, {{subscription, 1}, 0}}));
}

class MultiThreadedExecutor : public SingleThreadedExecutor {
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
  start(2);
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
  start(2);
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
  start(2);
  EXPECT_EQ(decide(0, 0ms).job->sequence, 0U);
  EXPECT_EQ(decide(1, 10ms).job->sequence, 1U);
}

TEST_F(MultiThreadedExecutor, OnlyOneIdleWorkerWaitsAndHandsTheWaitOn) {
  const TaskId a = add_timer(set, 100ms, 0ms, 10ms);
  start(3);
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
  start(2);
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
  start(2);
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
  start(2);
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
    OneWorkerFixture::start(2U, blocked);
    const Job running = *decide(0, 0ms).job;
    EXPECT_EQ(running.task, a);
    EXPECT_FALSE(decide(1, 1ms).job);           // polls: b stays, or is forgotten
    scheduler->finished(0, running, at(10ms));  // a is due again
    EXPECT_EQ(decide(1, 10ms).job->task, blocked == Blocked::kept ? b : a);
  }
}

class RebuiltWaitSet : public OneWorkerFixture<RebuiltWaitSetScheduler> {};

TEST_F(RebuiltWaitSet, AGroupThatWasBusyAtARebuildGoesToTheEnd) {
  const TaskId a = add_timer(set, 10ms, 0ms);
  const TaskId b = add_timer(set, 10ms, 0ms);
  start(2U);
  const Job first = *scheduler->decide(0, at(0ms)).job;
  const Job second = *scheduler->decide(1, at(0ms)).job;
  EXPECT_EQ(first.task, a);
  EXPECT_EQ(second.task, b);
  scheduler->finished(1, second, at(2ms));
  EXPECT_FALSE(scheduler->decide(1, at(2ms)).job);  // rebuilt without a
  scheduler->finished(0, first, at(3ms));
  EXPECT_FALSE(scheduler->decide(1, at(3ms)).job);  // rebuilt: b, a
  EXPECT_FALSE(scheduler->decide(0, at(3ms)).job);
  EXPECT_EQ(scheduler->decide(1, at(10ms)).job->task, b);
  EXPECT_EQ(scheduler->decide(0, at(10ms)).job->task, a);
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

TEST(MultiThreadedExecutorSimulated, OneGroupOnTwoCoresIsSequentialAndTwoGroupsAreParallel) {
  TaskSet set;
  add_timer(set, 20ms, 5ms);
  add_timer(set, 20ms, 5ms);
  Platform two_cores;
  two_cores.cores = 2;
  EXPECT_EQ(schedule(run(set, "multi", 20ms, two_cores, {.workers = 2})),
            (std::vector<Ran>{{0, 0, 0ms, 5ms}, {1, 0, 0ms, 5ms}}));
  set.tasks[1].group = set.tasks[0].group;
  EXPECT_EQ(schedule(run(set, "multi", 20ms, two_cores, {.workers = 2})),
            (std::vector<Ran>{{0, 0, 0ms, 5ms}, {1, 0, 5ms, 10ms}}));
}

}  // namespace
}  // namespace hotpath::test
