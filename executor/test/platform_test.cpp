// SPDX-License-Identifier: Apache-2.0
// The simulator's machine: cores, thread priorities, time slices, costs and delays.
#include "hotpath/core/platform.hpp"

#include <gtest/gtest.h>

#include "schedule_checks.hpp"

namespace hotpath::test::platform_test {

struct Timing {
  Duration period, wcet, phase{};
};

TaskSet timers(const std::vector<Timing>& timings) {
  TaskSet set;
  for (const auto& [period, wcet, phase] : timings) add_timer(set, period, wcet, phase);
  return set;
}

TEST(DefaultPlatform, RaisesTheReleaserOfThePapersExecutorsOnly) {
  int raised = 0;
  for (const ExecutorEntry& executor : executors()) {
    const bool of_paper = executor.traits.family == Family::priority_events;
    EXPECT_EQ(default_platform(executor).raised_releaser, of_paper) << executor.name;
    if (of_paper) ++raised;
  }
  EXPECT_EQ(raised, 8);  // four policies, each release-only and release-and-execute
}

TEST(ReleaseCost, SectionVBProlongsTheJobInExecutionByDeltaPerRelease) {
  const TaskSet set = timers({{100ms, 5ms}, {100ms, 1ms, 1ms}, {100ms, 1ms, 2ms}});
  const Trace trace = run(set, "rm-ro", 20ms, {.release_cost = 100us});
  EXPECT_EQ(schedule(trace),
            (std::vector<Ran>{{0, 0, 100us, 5300us}, {1, 0, 5300us, 6300us}, {2, 0, 6300us, 7300us}}));
  EXPECT_EQ(trace.jobs[1].job.release, at(1ms));
}

TEST(ReleaseCost, PapersReleaserWakesTheExecutorOnceAfterTheWholeBatch) {
  const TaskSet set = timers({{100ms, 1ms}, {100ms, 1ms}, {100ms, 1ms, 5ms}});  // two passes
  EXPECT_EQ(schedule(run(set, "rm-ro", 20ms, {.cores = 2, .release_cost = 100us, .pass_cost = 10us})),
            (std::vector<Ran>{{0, 0, 210us, 1210us}, {1, 0, 1210us, 2210us}, {2, 0, 5110us, 6110us}}));
}

TEST(ReleaseCost, StockReleaserWakesTheExecutorAfterEachTimerAndPaysKOncePerPass) {
  const TaskSet set = timers({{100ms, 50us}, {100ms, 50us}, {100ms, 50us}});
  EXPECT_EQ(schedule(run(set, "events-ro", 20ms, {.cores = 2, .release_cost = 100us, .pass_cost = 10us})),
            (std::vector<Ran>{{0, 0, 110us, 160us}, {1, 0, 210us, 260us}, {2, 0, 310us, 360us}}));
}

TEST(ReleaseCost, RaisedReleaserOnOneCoreFinishesItsBatchFirst) {
  const TaskSet set = timers({{100ms, 50us}, {100ms, 50us}, {100ms, 50us}});
  EXPECT_EQ(schedule(run(set, "events-ro", 20ms, {.release_cost = 100us})),
            (std::vector<Ran>{{0, 0, 300us, 350us}, {1, 0, 350us, 400us}, {2, 0, 400us, 450us}}));
}

TEST(ReleaseCost, NobodyDecidesWhileTheReleaserHoldsTheLock) {
  // The executor worker finishes on its own core in the middle of the release of the more urgent timer.
  const TaskSet set = timers({{100ms, 1050us}, {50ms, 1ms, 500us}, {20ms, 1ms, 1100us}});
  EXPECT_EQ(schedule(run(set, "rm-ro", 10ms, {.cores = 2, .release_cost = 100us})),
            (std::vector<Ran>{{0, 0, 100us, 1150us}, {2, 0, 1200us, 2200us}, {1, 0, 2200us, 3200us}}));
}

TEST(ReleaseCost, SectionVBReleaseAndExecutePaysForTheScanBeforeTheJob) {
  const TaskSet set = timers({{100ms, 1ms}, {100ms, 1ms}});
  EXPECT_EQ(schedule(run(set, "rm-re", 20ms, {.release_cost = 100us, .pass_cost = 10us})),
            (std::vector<Ran>{{0, 0, 210us, 1210us}, {1, 0, 1210us, 2210us}}));
}

TEST(DispatchCost, JobThatIsDecidedButNotStartedAtTheEndIsQueued) {
  const TaskSet set = timers({{100ms, 1ms}});
  const Trace trace = run(set, "default", 1ms, {.timer_dispatch_cost = 2ms});
  EXPECT_EQ(count(trace, 0, Outcome::queued), 1U);
  EXPECT_EQ(balanced(set, trace), "");
}

TEST(WakeUpLatency, DelaysSleepersButNotBusyWorkers) {
  const TaskSet set = timers({{100ms, 2ms, 1ms}, {100ms, 2ms, 2ms}});
  for (const char* executor : {"default", "static"})  // a wait of a sleeper has no other cost
    EXPECT_EQ(schedule(run(set, executor, 20ms, {.wait_cost = 30us, .wake_up_latency = 100us})),
              (std::vector<Ran>{{0, 0, 1100us, 3100us}, {1, 0, 3130us, 5130us}}));
  // Releaser and executor worker both sleep.
  EXPECT_EQ(schedule(run(set, "rm-ro", 20ms, {.wake_up_latency = 100us}))[0], (Ran{0, 0, 1200us, 3200us}));
}

TEST(WakeUpLatency, DoesNotDelayAWorkerThatQueuesForTheMutex) {
  const TaskSet set = timers({{100ms, 2ms, 1ms}, {100ms, 2ms, 1ms}});
  EXPECT_EQ(schedule(run(set, "multi", 20ms, {.cores = 2, .wake_up_latency = 100us}, {.workers = 2})),
            (std::vector<Ran>{{0, 0, 1100us, 3100us}, {1, 0, 1100us, 3100us}}));
}

/// A timer of 10 ms with 4 ms of work in the timer thread, and a subscription to another timer.
TEST(ReleaseAndExecute, ThreadsShareCoresByPriorityAndTimeSlice) {
  TaskSet set;
  const TaskId source = add_timer(set, 100ms, 1ms);
  const TaskId frequent = add_timer(set, 10ms, 4ms, 3ms);
  const TaskId subscription = add_subscription(set, {source}, 5ms);
  const struct {
    const char* what;
    Platform platform;
    Duration subscription_ends, frequent_starts, frequent_ends;
  } rows[] = {
      {"a raised timer thread preempts the executor thread", {}, 10ms, 3ms, 7ms},
      {"1 + 5 ms of wall-clock work have passed at 6 ms, and the job ends as soon as it gets the core again",
       {.wall_clock_work = true},
       7ms,
       3ms,
       7ms},
      {"the executor thread holds the core from 1 ms to 4 ms; then they alternate every 3 ms",
       {.raised_releaser = false, .time_slice = 3ms},
       9ms,
       4ms,
       10ms},
      {"two cores serve both threads at once", {.cores = 2}, 6ms, 3ms, 7ms},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(schedule(run(set, "rm-re", 12ms, row.platform)),
              (std::vector<Ran>{{source, 0, 0ms, 1ms},
                                {subscription, 0, 1ms, row.subscription_ends},
                                {frequent, 0, row.frequent_starts, row.frequent_ends}}))
        << row.what;
  }
}

TEST(RoundRobin, WorkersThatOutnumberTheCoresShareThemEvenly) {
  const TaskSet set = timers({{100ms, 4ms}, {100ms, 4ms}, {100ms, 4ms}});
  // 0 and 1 start; at 2 ms one of them yields to 2, and so on: 12 ms of work on two cores.
  const Trace trace = run(set, "multi", 50ms, {.cores = 2, .time_slice = 2ms}, {.workers = 3});
  Time last{};
  for (const JobRecord& r : trace.jobs) last = std::max(last, r.finish);
  EXPECT_EQ(schedule(trace).size(), 3U);
  EXPECT_EQ(last, at(6ms));
}

TEST(RoundRobin, WorkersOfOneCoreAlternateFromTheFirstFullSliceOn) {
  const TaskSet set = timers({{100ms, 4ms}, {100ms, 4ms}});
  EXPECT_EQ(schedule(run(set, "multi", 20ms, {.time_slice = 2ms}, {.workers = 2})),
            (std::vector<Ran>{{0, 0, 0ms, 6ms}, {1, 0, 2ms, 8ms}}));
}

TEST(RoundRobin, AWorkerThatWasDisplacedHasTheRestOfItsSlice) {
  const TaskSet set = timers({{100ms, 4ms}, {100ms, 1ms}, {100ms, 0ms, 1ms}});
  const Platform platform{.time_slice = 2ms, .release_cost = 100us};
  EXPECT_EQ(schedule(run(set, "rm-ro", 20ms, platform, {.release_only_workers = 2}))[1],
            (Ran{1, 0, 2300us, 3300us}));
}

TEST(RoundRobin, ReleaserOfEqualPriorityWaitsAtMostOneTimeSlice) {
  TaskSet set;
  add_timer(set, 100ms, 20ms);
  for (int i = 1; i <= 15; ++i) add_timer(set, 100ms, 1ms, 1ms * i + 300us);
  const Trace trace = run(set, "events-ro", 50ms, {.raised_releaser = false, .time_slice = 2ms});
  Duration latest{};
  for (const JobRecord& r : trace.jobs) latest = std::max(latest, r.job.release - r.job.timestamp);
  EXPECT_GT(latest, 0ms);
  EXPECT_LE(latest, 2ms);
}

TEST(Cores, MoreCoresThanWorkersChangeNothing) {
  Random random(41);
  const TaskSet set = random_graph(random, 4, 6, 0.9);
  EXPECT_EQ(schedule(run(set, "rm-re", 300ms, {.cores = 2})),
            schedule(run(set, "rm-re", 300ms, {.cores = 1000})));
}

TEST(Cores, NeverMoreWorkDoneThanCoresHaveTime) {
  Random random(42);
  for (int i = 0; i < 50; ++i) {
    const TaskSet set = random_graph(random, 5, 6, 3.0);
    Platform p;
    p.cores = static_cast<unsigned>(uniform(random, 1, 3));
    const Trace trace = run(set, "multi", 200ms, p, {.workers = 6});
    Duration work{};
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome == Outcome::ran) work += set[r.job.task].wcet;
    }
    ASSERT_LE(work, 200ms * p.cores);
  }
}

}  // namespace hotpath::test::platform_test
