// SPDX-License-Identifier: Apache-2.0
// Compares analysis and simulation of thousands of random sets.
#include <gtest/gtest.h>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "reference_simulation.hpp"

namespace hotpath::response_time_property_test {

constexpr int kSets = 2000;

RandomSet every_kind(RandomStream& random) {
  RandomSet parameters;
  parameters.shorter_runs = random.below(2) == 0;
  parameters.constrained = random.below(2) == 0;
  return parameters;
}

std::vector<std::int64_t> simulated(const PeriodicTasks& tasks, Rule rule, RandomStream& random) {
  auto jobs = draw_jobs(tasks, 2 * hyperperiod(tasks), random);
  simulate(jobs, rule);
  return largest_response_times(jobs, tasks.size());
}

/// The bounds are no less than a simulation.
void check_simulated(const ResponseTimes& bounds, const PeriodicTasks& tasks, Rule rule,
                     RandomStream& random) {
  const auto largest = simulated(tasks, rule, random);
  for (std::size_t k = 0; k < tasks.size(); ++k)
    ASSERT_GE(*bounds[k], largest[k]) << "task " << k << as_graph(tasks);
}

TEST(NonPreemptiveFp, Theorem1BoundsExactBoundsSimulation) {
  RandomStream random(1, {0});
  int accepted = 0;
  for (int set = 0; set < kSets; ++set) {
    const PeriodicTasks tasks = random_tasks(random, every_kind(random));
    const ResponseTimes theorem1 = brueggen_2015(tasks);
    const ResponseTimes supremum = davis_2007(tasks, TimeModel::continuous);
    const ResponseTimes integer = davis_2007(tasks, TimeModel::discrete);
    if (!schedulable(tasks, theorem1)) continue;
    ++accepted;
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      ASSERT_GE(*theorem1[k], *supremum[k]) << "task " << k << as_graph(tasks);
      ASSERT_GE(*supremum[k], *integer[k]) << "task " << k << as_graph(tasks);
    }
    for (int run = 0; run < 6; ++run) {
      PeriodicTasks phased = tasks;
      for (PeriodicTask& t : phased)
        t.phase = run % 2 == 0 ? 0 : static_cast<std::int64_t>(random.below(t.period));
      check_simulated(integer, phased, Rule::fixed_priority, random);
    }
  }
  EXPECT_GT(accepted, kSets / 10);
}

TEST(NonPreemptiveFp, ExactWithJitterAndOverrunDeadlinesBoundsSimulation) {
  RandomStream random(2, {0});
  int compared = 0;
  for (int set = 0; set < kSets; ++set) {
    RandomSet parameters = every_kind(random);
    parameters.jitter = true;
    const PeriodicTasks tasks = random_tasks(random, parameters);
    const ResponseTimes integer = davis_2007(tasks, TimeModel::discrete);
    if (!integer.back()) continue;
    ++compared;
    check_simulated(integer, tasks, Rule::fixed_priority, random);
  }
  EXPECT_GT(compared, kSets / 10);
}

TEST(TimeModel, ContinuousIsTheLimitOfEverFinerDiscreteTime) {
  constexpr std::int64_t kFine = 1000;
  RandomStream random(3, {0});
  for (int set = 0; set < kSets; ++set) {
    RandomSet parameters;
    parameters.jitter = random.below(2) == 0;
    const PeriodicTasks tasks = random_tasks(random, parameters);
    PeriodicTasks fine = tasks;
    for (PeriodicTask& t : fine) {
      t.wcet *= kFine, t.bcet *= kFine, t.period *= kFine, t.deadline *= kFine, t.jitter *= kFine;
    }
    const ResponseTimes limit = davis_2007(tasks), near = davis_2007(fine, TimeModel::discrete);
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      ASSERT_EQ(limit[k].has_value(), near[k].has_value()) << as_graph(tasks);
      if (!limit[k]) continue;
      const std::int64_t blocked = k + 1 < tasks.size() ? 1 : 0;
      ASSERT_EQ(*limit[k] * kFine - blocked, *near[k]) << "task " << k << as_graph(tasks);
    }
    if (parameters.jitter || utilisation(tasks) > 1) continue;
    const ResponseTimes edf = spuri_1996(tasks), edf_near = spuri_1996(fine, TimeModel::discrete);
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      ASSERT_GE(*edf[k] * kFine, *edf_near[k]) << "task " << k << as_graph(tasks);
      ASSERT_LE(*edf[k] * kFine - 1, *edf_near[k]) << "task " << k << as_graph(tasks);
    }
  }
}

TEST(NonPreemptiveEdf, WcrtBoundsSimulation) {
  RandomStream random(4, {0});
  int passed = 0, failed = 0;
  for (int set = 0; set < kSets; ++set) {
    const PeriodicTasks tasks = random_tasks(random, every_kind(random));
    exact::Utilisation load;
    for (const PeriodicTask& t : tasks) load.add(t.wcet, t.period);
    if (load.compare_to_one() > 0) continue;
    const ResponseTimes bounds = spuri_1996(tasks, TimeModel::discrete);
    ++(schedulable(tasks, bounds) ? passed : failed);
    check_simulated(bounds, tasks, Rule::edf, random);
  }
  EXPECT_GT(passed, kSets / 10);
  EXPECT_GT(failed, kSets / 10);
}

TEST(Fifo, BoundHoldsForEveryPhase) {
  RandomStream random(5, {0});
  for (int set = 0; set < kSets; ++set) {
    RandomSet parameters = every_kind(random);
    parameters.phases = true;
    const PeriodicTasks tasks = random_tasks(random, parameters);
    if (utilisation(tasks) > 0.999) continue;
    const std::int64_t bound = bedarkar_2022(tasks);
    for (const std::int64_t largest : simulated(tasks, Rule::fifo, random))
      ASSERT_GE(bound, largest) << as_graph(tasks);
  }
}

}  // namespace hotpath::response_time_property_test
