// SPDX-License-Identifier: Apache-2.0
// Section V: compares the bounds with hotpath's own schedulers in virtual time, with the cost of
// releases.
#include <gtest/gtest.h>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/release_overhead.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/core/simulator.hpp"
#include "task_sets.hpp"

namespace hotpath::executor_simulation_test {

/// Timers of a few milliseconds in random order of creation.
TaskSet random_timers(RandomStream& random) {
  RandomSet parameters;
  parameters.phases = random.below(2) == 0;
  parameters.shorter_runs = random.below(2) == 0;
  PeriodicTasks tasks = random_tasks(random, parameters);
  random.shuffle(std::span(tasks));
  TaskSet set;
  for (const PeriodicTask& p : tasks) set.tasks.push_back(as_timer(p, "t" + std::to_string(set.size()), kMs));
  return set;
}

/// With a raised releaser: one that is late would skip timestamps. Odd seeds draw execution times.
Trace simulated(const TaskSet& set, const char* executor, Duration delta, std::uint64_t seed) {
  SimulationOptions options;
  options.platform.release_cost = delta;
  options.duration = std::chrono::milliseconds(500);
  const UniformTimes drawn(set, seed);
  const WorstCaseTimes longest(set);
  PublishingWorkload workload(seed % 2 == 0 ? static_cast<const ExecutionTimes&>(longest) : drawn);
  return simulate_trace(set, *find_executor(executor), {}, workload, options);
}

/// Checks that every finished job met the bound of its task and that no timestamp was skipped.
void expect_within(const Trace& trace, const TaskSet& set, const PeriodicTasks& tasks,
                   const ResponseTimes& bounds) {
  std::vector<std::int64_t> bound(set.size());
  for (std::size_t k = 0; k < tasks.size(); ++k) bound[tasks[k].id] = *bounds[k];
  for (const JobRecord& r : trace.jobs) {
    ASSERT_EQ(r.job.skipped, 0U) << set[r.job.task].name << " under " << trace.executor;
    if (r.outcome != Outcome::ran) continue;
    ASSERT_LE((r.finish - r.job.timestamp).count(), bound[r.job.task])
        << set[r.job.task].name << " released at " << to_ns(r.job.timestamp) << " under " << trace.executor;
  }
}

struct Case {
  const char* executor;
  Policy policy;
  ReleaseMode mode;
  ResponseTimes (*analysis)(const PeriodicTasks&);
};

class SectionV : public testing::TestWithParam<Case> {};

TEST_P(SectionV, BoundsWithReleaseOverheadHoldForTheSimulatedExecutor) {
  const Case& c = GetParam();
  RandomStream random(51, {0});
  int compared = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const TaskSet set = random_timers(random);
    const Duration delta(i % 3 == 0 ? 0 : static_cast<std::int64_t>(random.below(200)) * kUs);
    const PeriodicTasks tasks = periodic_tasks(set, c.policy);
    OverheadAwareResponse response;
    try {
      response = with_release_overhead(tasks, delta.count(), c.mode, c.analysis);
    } catch (const AnalysisError&) {
      continue;  // violates condition C1 or the utilisation limit
    }
    if (!schedulable(response.tasks, response.bounds)) continue;
    ++compared;
    expect_within(simulated(set, c.executor, delta, i), set, tasks, response.bounds);
    if (HasFatalFailure()) {
      PeriodicTasks in_ms = tasks;
      for (PeriodicTask& t : in_ms)
        t.wcet /= kMs, t.bcet /= kMs, t.period /= kMs, t.deadline /= kMs, t.phase /= kMs;
      FAIL() << "delta " << delta.count() << " ns" << as_graph(in_ms);
    }
  }
  EXPECT_GT(compared, 60);
}

ResponseTimes exact_np_fp(const PeriodicTasks& tasks) { return davis_2007(tasks); }
ResponseTimes np_edf(const PeriodicTasks& tasks) { return spuri_1996(tasks); }

INSTANTIATE_TEST_SUITE_P(
    PaperExecutors, SectionV,
    testing::Values(Case{"rm-ro", Policy::rm, ReleaseMode::release_only, brueggen_2015},
                    Case{"rm-ro", Policy::rm, ReleaseMode::release_only, exact_np_fp},
                    Case{"rm-re", Policy::rm, ReleaseMode::release_and_execute, brueggen_2015},
                    Case{"rm-re", Policy::rm, ReleaseMode::release_and_execute, exact_np_fp},
                    Case{"edf-ro", Policy::edf, ReleaseMode::release_only, np_edf},
                    Case{"edf-re", Policy::edf, ReleaseMode::release_and_execute, np_edf}),
    [](const auto& instance) { return "Case" + std::to_string(instance.index); });

TEST(Fifo, BoundHoldsForTheStockEventsExecutorWhereItSkipsNothing) {
  RandomStream random(52, {0});
  int compared = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const TaskSet set = random_timers(random);
    const PeriodicTasks tasks = periodic_tasks(set, Policy::fifo);
    if (utilisation(tasks) > 0.999) continue;
    const ResponseTimes bounds(tasks.size(), bedarkar_2022(tasks));
    ++compared;
    expect_within(simulated(set, "events-ro", Duration{}, 0), set, tasks, bounds);
    ASSERT_FALSE(HasFatalFailure()) << i;
  }
  EXPECT_GT(compared, 60);
}

}  // namespace hotpath::executor_simulation_test
