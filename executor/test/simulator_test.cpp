// SPDX-License-Identifier: Apache-2.0
// The discrete-event simulator: its calls, records, workloads and refusals.
#include "hotpath/core/simulator.hpp"

#include <gmock/gmock.h>

#include <functional>

#include "schedule_checks.hpp"

namespace hotpath::test::simulator_test {

using testing::HasSubstr;

TEST(Simulator, RecordsWhatIsLeftAtTheEndAsRunningAndQueued) {
  TaskSet set;
  const TaskId long_one = add_timer(set, 100ms, 50ms);
  const TaskId waiting = add_timer(set, 100ms, 1ms, 5ms);
  const TaskId never = add_timer(set, 100ms, 1ms, 10ms);
  for (const char* executor : {"default", "static", "events-ro", "events-re", "rm-ro", "edf-re"}) {
    const Trace trace = run(set, executor, 10ms);
    EXPECT_EQ(count(trace, long_one, Outcome::running), 1U) << executor;
    EXPECT_EQ(count(trace, waiting, Outcome::queued), 1U) << executor;
    EXPECT_EQ(count(trace, never, Outcome::queued), 0U) << executor;  // due at the end, not before
    EXPECT_EQ(balanced(set, trace), "");
  }
}

TEST(Simulator, RecordsOverwrittenSamplesAndEmptyEvents) {
  TaskSet set;
  const TaskId busy = add_timer(set, 100ms, 30ms, 25ms);
  const TaskId publisher = add_timer(set, 10ms, 1ms);
  set.tasks[publisher].priority = 1;
  set.tasks[busy].priority = 0;
  const TaskId subscription = add_subscription(set, {publisher}, 1ms);
  set.tasks[subscription].priority = 2;
  const Trace trace = run(set, "fp-ro", 100ms);
  // The samples of 30, 40 and 50 ms are released after the long job, before their subscription
  // runs.
  EXPECT_EQ(count(trace, subscription, Outcome::overwritten), 2U);
  EXPECT_EQ(count(trace, subscription, Outcome::empty), 2U);
  EXPECT_EQ(balanced(set, trace), "");
  for (const JobRecord& r : trace.jobs) EXPECT_TRUE(r.outcome != Outcome::empty || r.start == r.finish);
}

/// Sequence numbers, and instants in microseconds, beyond 32 bits.
TEST(Simulator, CountsBeyond32BitsInASimulationOfHours) {
  TaskSet set;
  const TaskId fast = add_timer(set, 1ns, 100ms);  // each of its jobs skips 10^8 timestamps
  const TaskId slow = add_timer(set, 60s, 1ms);
  const TaskId subscription = add_subscription(set, {slow}, 1ms);
  const Trace trace = run(set, "default", 2h);
  constexpr std::uint64_t kBeyond = std::uint64_t{1} << 32;
  EXPECT_EQ(legal(set, trace), "");
  EXPECT_EQ(balanced(set, trace), "");
  const JobRecord& last = *std::ranges::find_if(trace.jobs.rbegin(), trace.jobs.rend(), &JobRecord::started);
  EXPECT_EQ(last.job.task, fast);
  EXPECT_GT(last.job.sequence, kBeyond);
  EXPECT_EQ(last.job.sequence, static_cast<std::uint64_t>((last.job.timestamp - trace.epoch).count()));
  EXPECT_GT(static_cast<std::uint64_t>((last.start - trace.epoch) / 1us), kBeyond);
  EXPECT_EQ(count(trace, subscription, Outcome::ran), 120U);
}

TEST(UniformTimes, CoverBcetToWcetAndDependOnSeedTaskAndSequenceOnly) {
  TaskSet set;
  add_timer(set, 10ms, 9ns);
  add_timer(set, 10ms, 9ns);
  for (Task& task : set.tasks) task.bcet = 4ns;
  const UniformTimes times(set, 1), again(set, 1), other(set, 2);
  std::vector<int> seen(10, 0);
  int differ_by_task = 0, differ_by_seed = 0;
  for (std::uint64_t i = 0; i < 6000; ++i) {
    const Job a{.task = 0, .sequence = i}, b{.task = 1, .sequence = i};
    ++seen.at(static_cast<std::size_t>(times.of(a).count()));
    EXPECT_EQ(times.of(a), again.of(a));
    differ_by_task += times.of(a) != times.of(b);
    differ_by_seed += times.of(a) != other.of(a);
  }
  for (std::size_t ns = 0; ns < 4; ++ns) EXPECT_EQ(seen[ns], 0);
  for (std::size_t ns = 4; ns < 10; ++ns) EXPECT_NEAR(seen[ns], 1000, 150);
  EXPECT_NEAR(differ_by_task, 5000, 200);
  EXPECT_NEAR(differ_by_seed, 5000, 200);
}

TEST(ReplayedTimes, RepeatTheTraceAndFallBackToTheLastEarlierJob) {
  TaskSet set;
  add_timer(set, 10ms, 9ms);
  add_timer(set, 10ms, 8ms);
  Trace trace;
  for (const auto& [sequence, time] : {std::pair{5U, 2ms}, std::pair{3U, 1ms}}) {
    trace.jobs.push_back(
        {.job = {.task = 0, .sequence = sequence}, .start = at(100ms), .finish = at(100ms + time)});
  }
  const ReplayedTimes times(set, trace);
  for (const auto& [task, sequence, time] :
       {std::tuple{0U, 3U, 1ms}, {0U, 4U, 1ms}, {0U, 5U, 2ms}, {0U, 6U, 2ms}, {0U, 0U, 1ms}, {1U, 0U, 8ms}})
    EXPECT_EQ(times.of({.task = task, .sequence = sequence}), time) << task << " #" << sequence;
}

class Refusal : public testing::Test {
 protected:
  Refusal() { add_timer(set, 10ms, 1ms); }
  /// Of the refusal; empty if there is none.
  std::string message(const char* executor = "rm-ro") {
    const WorstCaseTimes times(set);
    PublishingWorkload workload(times);
    try {
      simulate_trace(set, *find_executor(executor), {}, workload, options);
    } catch (const SimulationError& e) {
      return e.what();
    }
    return "";
  }
  TaskSet set;
  SimulationOptions options;
};

TEST_F(Refusal, OptionsAndTasksThatCannotBeSimulated) {
  EXPECT_EQ(message(), "");
  Platform& p = options.platform;
  Task& task = set.tasks[0];
  const Task whole = task;
  const std::pair<std::function<void()>, const char*> cases[] = {
      {[&] { p.cores = 0; }, "at least one core"},
      {[&] { p.set_dispatch_costs(-1ns); }, "costs, delays and latencies"},
      {[&] { p.time_slice = 0ns; }, "time slice must be positive"},
      {[&] { options.duration = 0ns; }, "duration must be positive"},
      {[&] { options.duration = Duration::max(); }, "overflow"},
      {[&] { task.period = 0ns; }, "task `T0`: the period"},
      {[&] { task.phase = Duration::max(); }, "task `T0`"}};
  for (const auto& [change, said] : cases) {
    change();
    EXPECT_THAT(message(), HasSubstr(said));
    options = {};
    task = whole;
  }
}

TEST_F(Refusal, OverloadStopsAtTheBacklogAndNamesTheUtilisation) {
  set.tasks[0].wcet = 15ms;
  options.duration = 1h;
  options.max_backlog = 1000;
  EXPECT_THAT(message(), HasSubstr("more than 1000 released jobs"));
  EXPECT_THAT(message(), HasSubstr("utilisation is 1.500"));
}

TEST_F(Refusal, OverloadByStarvedSubscriptionsStopsToo) {
  // The raised timer thread leaves no core time for the executor worker.
  set.tasks[0].wcet = 10ms;
  add_subscription(set, {0}, 1ms);
  options.max_backlog = 50;
  EXPECT_NE(message("rm-re"), "");
}

TEST_F(Refusal, ExecutionTimeOutOfRange) {
  struct Backwards final : Workload {
    Duration start(const Job&, Time) override { return -1ns; }
    std::span<const TaskId> finish(const Job&, const Task&, Time) override { return {}; }
  };
  Backwards workload;
  EXPECT_THROW(simulate_trace(set, *find_executor("default"), {}, workload, options), SimulationError);
}

TEST(Utilisation, CountsTimersByPeriodAndSubscriptionsByTheirSamples) {
  TaskSet set;
  const TaskId timer = add_timer(set, 10ms, 2ms);
  add_subscription(set, {timer}, 3ms);
  EXPECT_DOUBLE_EQ(utilisation(set, {0, 10}, 100ms), 0.5);
}

TEST(SectionVA, ReleaseOnlyAndReleaseAndExecuteDifferWhereAWcetExceedsAPeriodBecauseReleasesAreSkipped) {
  TaskSet set;
  const TaskId long_one = add_timer(set, 100ms, 25ms);
  const TaskId frequent = add_timer(set, 10ms, 1ms, 1ms);
  set.tasks[long_one].priority = 1;
  set.tasks[frequent].priority = 0;
  for (const std::string policy : {"rm", "dm", "fp", "edf"}) {
    const Trace ro = run(set, policy + "-ro", 100ms), re = run(set, policy + "-re", 100ms);
    // Timestamps 1, 11 and 21 ms pass while the long job runs.
    EXPECT_EQ(skipped(ro, frequent), 0U);
    EXPECT_EQ(count(ro, frequent, Outcome::ran), 10U);
    EXPECT_EQ(skipped(re, frequent), 2U);
    EXPECT_EQ(count(re, frequent, Outcome::ran), 8U);
  }
}

}  // namespace hotpath::test::simulator_test
