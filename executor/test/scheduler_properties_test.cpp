// SPDX-License-Identifier: Apache-2.0
// What must hold of the schedule of every executor, over random task sets and random graphs.
#include <gtest/gtest.h>

#include "hotpath/core/registry.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test {
namespace {

constexpr Duration kRun = 400ms;

/// Random execution times in [BCET, WCET].
Trace run_random(const TaskSet& set, const ExecutorEntry& executor, std::uint64_t seed,
                 const Platform& platform, const SchedulerOptions& scheduling = {}) {
  const UniformTimes times(set, seed);
  PublishingWorkload workload(times);
  SimulationOptions options;
  options.platform = platform;
  options.duration = kRun;
  return simulate_trace(set, executor, scheduling, workload, options);
}

std::string policy_of(const ExecutorEntry& executor) {
  return std::string(executor.name.substr(0, executor.name.find('-')));
}
bool is(const ExecutorEntry& executor, const char* ending) { return executor.name.ends_with(ending); }

class EveryExecutor : public testing::TestWithParam<const ExecutorEntry*> {};

TEST_P(EveryExecutor, ScheduleIsLegalAndNothingIsLostOnAnyPlatform) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    TaskSet set =
        random_graph(random, static_cast<int>(uniform(random, 1, 6)), static_cast<int>(uniform(random, 0, 8)),
                     0.1 * static_cast<double>(uniform(random, 1, 14)));
    for (CallbackGroup& group : set.groups) {
      if (uniform(random, 0, 2) == 0) group = CallbackGroup::reentrant;
    }
    const auto last_group = static_cast<std::int64_t>(set.groups.size()) - 1;
    for (Task& task : set.tasks) {
      if (uniform(random, 0, 2) == 0) task.group = static_cast<std::uint32_t>(uniform(random, 0, last_group));
    }
    Platform platform;
    platform.cores = static_cast<unsigned>(uniform(random, 1, 3));
    platform.raised_releaser = uniform(random, 0, 1) == 0;
    platform.time_slice = uniform(random, 100, 4000) * 1us;
    platform.wall_clock_work = uniform(random, 0, 1) == 0;
    if (uniform(random, 0, 1) == 0) {
      platform.release_cost = uniform(random, 0, 100) * 1us;
      platform.pass_cost = uniform(random, 0, 100) * 1us;
      platform.dispatch_cost = uniform(random, 0, 100) * 1us;
      platform.delivery_delay = uniform(random, 0, 2000) * 1us;
      platform.wake_up_latency = uniform(random, 0, 200) * 1us;
    }
    SchedulerOptions scheduling;
    scheduling.rule = uniform(random, 0, 1) == 0 ? SubscriptionRule::inherit : SubscriptionRule::first;
    scheduling.ties = uniform(random, 0, 1) == 0 ? Ties::lifo : Ties::fifo;
    scheduling.workers = static_cast<unsigned>(uniform(random, 1, 4));
    const auto seed = static_cast<std::uint64_t>(i);
    const Trace trace = run_random(set, *GetParam(), seed, platform, scheduling);
    ASSERT_EQ(legal(set, trace), "") << "set " << i;
    ASSERT_EQ(balanced(set, trace), "") << "set " << i;
    if (GetParam()->name == "multi" || GetParam()->name == "default") {
      ASSERT_EQ(groups_exclusive(set, trace), "") << "set " << i;
    }
  }
}

TEST_P(EveryExecutor, IsWorkConserving) {
  Random random(2);
  for (int i = 0; i < 600; ++i) {
    const TaskSet set =
        random_graph(random, static_cast<int>(uniform(random, 1, 6)), static_cast<int>(uniform(random, 0, 8)),
                     0.1 * static_cast<double>(uniform(random, 3, 11)), 1);
    const Trace trace = run_random(set, *GetParam(), static_cast<std::uint64_t>(i), {}, {.workers = 1});
    ASSERT_EQ(work_conserving(trace, 1), "") << "set " << i;
  }
}

TEST_P(EveryExecutor, RunsEveryJobForItsExecutionTimeWhenNobodyDisplacesIt) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const TaskSet set = random_graph(random, 4, 6, 0.8);
    Platform platform;
    platform.cores = 4;
    const Trace trace = run_random(set, *GetParam(), 7, platform, {.workers = 4});
    const UniformTimes times(set, 7);
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome != Outcome::ran) continue;
      ASSERT_EQ(r.finish - r.start, times.of(r.job)) << describe(r);
    }
  }
}

std::vector<const ExecutorEntry*> all() {
  std::vector<const ExecutorEntry*> entries;
  for (const ExecutorEntry& e : executors()) entries.push_back(&e);
  return entries;
}

std::string name(const testing::TestParamInfo<const ExecutorEntry*>& info) {
  std::string n(info.param->name);
  std::replace(n.begin(), n.end(), '-', '_');
  return n;
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryExecutor, testing::ValuesIn(all()), name);

TEST(MultiThreadedExecutor, ReentrantGroupsLeaveNoWorkerIdleWhileAJobWaits) {
  Random random(4);
  for (int i = 0; i < 600; ++i) {
    TaskSet set = random_graph(random, 5, 6, 2.0, 1);
    for (CallbackGroup& group : set.groups) group = CallbackGroup::reentrant;
    Platform platform;
    platform.cores = 3;
    const Trace trace = run_random(set, *find_executor("multi"), 5, platform, {.workers = 3});
    ASSERT_EQ(work_conserving(trace, 3), "") << "set " << i;
  }
}

class PaperExecutor : public testing::TestWithParam<const ExecutorEntry*> {};
class PaperReleaseOnly : public testing::TestWithParam<const ExecutorEntry*> {};

TEST_P(PaperExecutor, StartsNoJobWhileAHigherPriorityOneWaitsAndBlocksAtMostOnce) {
  Random random(5);
  for (int i = 0; i < 600; ++i) {
    // An event takes the oldest unread sample, whichever sample brought it. Under EDF it has that sample's
    // deadline if nothing is overwritten and the deadlines of a reader's samples never decrease.
    const bool edf = policy_of(*GetParam()) == "edf";
    TaskSet set =
        random_graph(random, static_cast<int>(uniform(random, 2, 6)), static_cast<int>(uniform(random, 0, 6)),
                     0.1 * static_cast<double>(uniform(random, 3, 11)), 3, edf ? 1 : 2);
    if (edf) {
      for (Task& task : set.tasks) task.depth = 1000;
    }
    std::vector<int> worker(set.size(), 0);
    for (TaskId id = 0; id < set.size(); ++id) {
      if (is(*GetParam(), "-re") && set[id].kind == TaskKind::timer) worker[id] = 1;
    }
    Platform platform;
    platform.cores = static_cast<unsigned>(uniform(random, 1, 2));
    const Trace trace = run_random(set, *GetParam(), static_cast<std::uint64_t>(i), platform);
    ASSERT_EQ(priority_driven(trace, PriorityByTheBook(set, policy_of(*GetParam())), worker), "")
        << "set " << i;
  }
}

TEST_P(PaperReleaseOnly, SkipsNoRelease) {
  Random random(6);
  for (int i = 0; i < 300; ++i) {
    const TaskSet set = random_graph(random, 5, 5, 0.1 * static_cast<double>(uniform(random, 3, 20)));
    const Trace trace = run_random(set, *GetParam(), static_cast<std::uint64_t>(i), {});
    for (TaskId id = 0; id < set.size(); ++id) ASSERT_EQ(skipped(trace, id), 0U) << "set " << i;
  }
}

std::vector<const ExecutorEntry*> paper(const char* ending) {
  std::vector<const ExecutorEntry*> entries;
  for (const ExecutorEntry& e : executors()) {
    if (e.paper && is(e, ending)) entries.push_back(&e);
  }
  return entries;
}

INSTANTIATE_TEST_SUITE_P(Registry, PaperExecutor, testing::ValuesIn(paper("")), name);
INSTANTIATE_TEST_SUITE_P(Registry, PaperReleaseOnly, testing::ValuesIn(paper("-ro")), name);

class SectionVA : public testing::TestWithParam<const char*> {};

TEST_P(SectionVA, ReleaseOnlyAndReleaseAndExecuteAgreeWhenEveryWcetIsBelowEveryPeriod) {
  Random random(7);
  const std::string policy = GetParam();
  int compared = 0;
  for (int i = 0; i < 1000; ++i) {
    const TaskSet set = random_timers(random, static_cast<int>(uniform(random, 2, 8)),
                                      0.1 * static_cast<double>(uniform(random, 2, 12)));
    Duration shortest = 1s, longest = 0s;
    for (const Task& task : set.tasks) {
      shortest = std::min(shortest, task.period);
      longest = std::max(longest, task.wcet);
    }
    if (longest >= shortest) continue;
    ++compared;
    const auto seed = static_cast<std::uint64_t>(i);
    ASSERT_EQ(schedule(run_random(set, *find_executor(policy + "-ro"), seed, {})),
              schedule(run_random(set, *find_executor(policy + "-re"), seed, {})))
        << "set " << i;
  }
  EXPECT_GT(compared, 400);
}

TEST_P(SectionVA, TheyDifferBeyondThatConditionBecauseReleasesAreSkipped) {
  TaskSet set;
  const TaskId long_one = add_timer(set, 100ms, 25ms);
  const TaskId frequent = add_timer(set, 10ms, 1ms, 1ms);
  set.tasks[long_one].priority = 1;
  set.tasks[frequent].priority = 0;
  const Trace ro = run(set, std::string(GetParam()) + "-ro", 100ms);
  const Trace re = run(set, std::string(GetParam()) + "-re", 100ms);
  // Timestamps 1, 11 and 21 ms pass while the long job runs.
  EXPECT_EQ(skipped(ro, frequent), 0U);
  EXPECT_EQ(count(ro, frequent, Outcome::ran), 10U);
  EXPECT_EQ(skipped(re, frequent), 2U);
  EXPECT_EQ(count(re, frequent, Outcome::ran), 8U);
}

INSTANTIATE_TEST_SUITE_P(EveryPolicy, SectionVA, testing::Values("rm", "dm", "fp", "edf"));

}  // namespace
}  // namespace hotpath::test
