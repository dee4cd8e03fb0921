// SPDX-License-Identifier: Apache-2.0
// Compares end-to-end bounds with each other and with the reaction times and data ages of simulated
// schedules.
#include <gtest/gtest.h>

#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "reference_simulation.hpp"

namespace hotpath::end_to_end_property_test {

/// The jobs of each task in order of their releases.
std::vector<std::vector<SimulatedJob>> by_task(const std::vector<SimulatedJob>& jobs, std::size_t tasks) {
  std::vector<std::vector<SimulatedJob>> lists(tasks);
  for (const SimulatedJob& j : jobs) lists[j.task].push_back(j);
  return lists;
}

struct Latency {
  std::int64_t reaction = 0, age = 0;
};

/// Data age lasts until the next output. Only events and data from `from` on count.
Latency measure(const std::vector<std::vector<SimulatedJob>>& jobs, const TaskChain& chain,
                std::int64_t from) {
  Latency latency{largest_reaction(jobs, chain, from)};
  const auto& last = jobs[chain.back()];
  for (std::size_t j = 0; j + 1 < last.size(); ++j) {
    const SimulatedJob* reader = &last[j];
    for (std::size_t i = chain.size() - 1; i > 0 && reader; --i) {
      const SimulatedJob* writer = nullptr;
      for (const SimulatedJob& w : jobs[chain[i - 1]]) {
        if (w.finish <= reader->start) writer = &w;
      }
      reader = writer;
    }
    if (!reader || reader->nominal < from) continue;
    latency.age = std::max(latency.age, last[j + 1].finish - reader->start);
  }
  return latency;
}

TaskChain random_chain(RandomStream& random, std::size_t tasks) {
  TaskChain chain;
  for (std::size_t n = 1 + random.below(4); n > 0; --n) chain.push_back(random.below(tasks));
  return chain;
}

void check_set(const PeriodicTasks& tasks, const ResponseTimes& bounds, Priorities priorities, Rule rule,
               RandomStream& random) {
  auto run = draw_jobs(tasks, 3 * hyperperiod(tasks), random);
  simulate(run, rule);
  const auto jobs = by_task(run, tasks.size());
  std::int64_t latest_phase = 0;
  for (const PeriodicTask& t : tasks) latest_phase = std::max(latest_phase, t.phase);
  for (int c = 0; c < 3; ++c) {
    const TaskChain chain = random_chain(random, tasks.size());
    const std::string where = as_graph(tasks) + as_text(chain);
    const std::int64_t davare = davare_2007(tasks, bounds, chain);
    const std::int64_t duerr = duerr_2019_reaction_time(tasks, bounds, chain, priorities);
    const std::int64_t guenzel = guenzel_2023(tasks, bounds, chain, priorities);
    const Latency latency = measure(jobs, chain, latest_phase);
    ASSERT_GE(davare, duerr) << where;
    ASSERT_GE(duerr, guenzel) << where;
    ASSERT_GE(guenzel, latency.reaction) << where;
    ASSERT_GE(guenzel, latency.age) << where;
    if (latest_phase == 0) {
      ASSERT_GE(kloda_2018(tasks, bounds, chain, priorities), latency.reaction) << where;
    }
  }
}

RandomSet small_set(RandomStream& random) {
  RandomSet parameters;
  parameters.max_tasks = 4;
  parameters.periods = {4, 5, 8, 10, 20};
  parameters.phases = random.below(2) == 0;
  parameters.shorter_runs = random.below(2) == 0;
  return parameters;
}

/// Checks 3000 random sets under NP-FP or NP-EDF. Returns the number of schedulable ones.
int check_sets(std::uint64_t seed, Priorities priorities, bool jitter) {
  const bool fixed = priorities == Priorities::fixed;
  RandomStream random(seed, {0});
  int compared = 0;
  for (int set = 0; set < 3000 && !testing::Test::HasFatalFailure(); ++set) {
    RandomSet parameters = small_set(random);
    parameters.jitter = jitter;
    const PeriodicTasks tasks = random_tasks(random, parameters);
    if (!fixed && utilisation(tasks) > 0.999) continue;
    const ResponseTimes bounds =
        fixed ? davis_2007(tasks, TimeModel::discrete) : spuri_1996(tasks, TimeModel::discrete);
    if (!schedulable(tasks, bounds)) continue;
    ++compared;
    check_set(tasks, bounds, priorities, fixed ? Rule::fixed_priority : Rule::edf, random);
  }
  return compared;
}

TEST(EndToEnd, DavareBoundsDuerrBoundsPhaseAwareBoundsSimulationUnderNpFp) {
  EXPECT_GT(check_sets(21, Priorities::fixed, false), 300);
}

TEST(EndToEnd, DavareBoundsDuerrBoundsPhaseAwareBoundsSimulationUnderNpEdf) {
  EXPECT_GT(check_sets(22, Priorities::dynamic, false), 300);
}

TEST(EndToEnd, JitterKeepsTheBoundsSafe) { EXPECT_GT(check_sets(23, Priorities::fixed, true), 200); }

}  // namespace hotpath::end_to_end_property_test
