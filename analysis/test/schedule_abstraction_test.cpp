// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hotpath/analysis/wcrt_table.hpp"
#include "hotpath/core/exploration.hpp"
#include "hotpath/core/registry.hpp"
#include "nasri_2017.hpp"
#include "task_sets.hpp"

namespace hotpath::schedule_abstraction_test {
namespace {

SagJob job(std::size_t task, std::int64_t r_min, std::int64_t r_max, std::int64_t c_min, std::int64_t c_max,
           std::int64_t priority) {
  return {task, r_min, r_max, c_min, c_max, priority};
}

TEST(NpSchedulabilityAnalysisTests, HaveTheirIntervals) {
  const struct {
    const char* name;
    std::vector<SagJob> jobs;
    std::vector<SagFinish> intervals;
  } rows[] = {
      {"all next jobs",
       {job(1, 0, 0, 3, 8, 1), job(2, 7, 7, 5, 5, 2), job(3, 10, 10, 1, 11, 3)},
       {{3, 8}, {12, 13}, {13, 24}}},
      {"large interval",
       {job(1, 0, 0, 3, 10, 3), job(2, 7, 7, 5, 5, 2), job(3, 10, 10, 5, 5, 1)},
       {{3, 10}, {12, 20}, {15, 19}}},
      {"priorities", {job(1, 0, 0, 3, 10, 2), job(2, 0, 0, 5, 5, 1)}, {{8, 15}, {5, 5}}},
      {"jitter", {job(1, 0, 1, 3, 10, 2), job(2, 0, 1, 5, 5, 1)}, {{3, 16}, {5, 15}}},
      {"eager",
       {job(1, 0, 0, 1, 5, 2), job(2, 0, 0, 1, 20, 3), job(3, 10, 10, 5, 5, 1)},
       {{1, 5}, {2, 25}, {15, 30}}},
      {"equal priorities",
       {job(1, 0, 10, 2, 50, 1), job(2, 0, 10, 50, 1200, 2), job(3, 1000, 1010, 2, 50, 1)},
       {{2, 1259}, {50, 1260}, {1002, 1310}}},
  };
  for (const auto& row : rows) EXPECT_EQ(nasri_2017(row.jobs), row.intervals) << row.name;
}

PeriodicTasks in_microseconds(int utilisation, bool shorter_runs) {
  PeriodicTasks tasks = paper_timers_only(utilisation);
  for (PeriodicTask& t : tasks) {
    t.period /= kUs;
    t.deadline /= kUs;
    t.wcet = t.wcet / kUs + 833;
    t.bcet = shorter_runs ? 0 : t.wcet;
  }
  return tasks;
}

TEST(NasriBrandenburg2017, PaperTaskSetsWithExecutionTimesFromZero) {
  const struct {
    int utilisation;
    std::vector<std::int64_t> us;
  } rows[] = {{60, {12665, 23498, 34331, 45164, 57830, 57831, 68664}},
              {90, {18665, 29498, 46331, 64997, 81830, 83664, 94497}}};
  for (const auto& row : rows) {
    const ResponseTimes bounds = sag_response_times(in_microseconds(row.utilisation, true), Policy::fp);
    EXPECT_THAT(bounds, testing::ElementsAreArray(row.us)) << row.utilisation;
  }
}

TEST(NasriBrandenburg2017, JitterNeedsAsManyHyperperiodsAsTheBusyWindowReachesBack) {
  PeriodicTasks tasks = {task(4, 10), task(3, 10)};
  tasks[0].jitter = 8;
  EXPECT_EQ(sag_response_times(tasks, Policy::fp)[1], 9);  // 7 in the first hyperperiod
}

/// The worst response times by the exploration of whole graphs, for the phases of the tasks.
class ExploredResponses final : public ExplorationObserver {
 public:
  ExploredResponses(const PeriodicTasks& tasks, const std::string& executor) : worst(tasks.size()) {
    TaskSet set;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      set.tasks.push_back(as_timer(tasks[i], std::to_string(i)));
      set.tasks.back().priority = static_cast<std::int64_t>(i);
    }
    const WorstCaseTimes times(set);
    explore(set, *find_executor(executor)->make(set, {}), PublishingWorkload(times), {}, *this);
  }

  void ended(const JobRecord& record, ExploredInstant& instant) override {
    std::optional<std::int64_t>& largest = worst[record.job.task];
    largest = std::max(largest.value_or(0), (instant.latest() - record.job.timestamp).count());
  }

  ResponseTimes worst;
};

TEST(Exploration, GivesTheSameForThePaperTaskSets) {
  for (const int utilisation : {60, 90}) {
    for (const bool shorter_runs : {false, true}) {
      const PeriodicTasks tasks = in_microseconds(utilisation, shorter_runs);
      EXPECT_EQ(ExploredResponses(tasks, "fp-ro").worst, sag_response_times(tasks, Policy::fp))
          << utilisation;
    }
  }
}

TEST(Exploration, GivesTheSameForRandomTasks) {
  RandomStream random(4, {0});
  int compared = 0;
  for (int set = 0; set < 300; ++set) {
    RandomSet parameters;
    parameters.phases = set % 2 == 1;
    parameters.shorter_runs = set % 4 >= 2;
    const PeriodicTasks tasks = random_tasks(random, parameters);
    if (utilisation(tasks) > 1) continue;
    for (const auto& [policy, executor] :
         {std::pair(Policy::fp, "fp-ro"), std::pair(Policy::edf, "edf-ro")}) {
      ASSERT_EQ(ExploredResponses(tasks, executor).worst, sag_response_times(tasks, policy))
          << executor << as_graph(tasks);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

}  // namespace
}  // namespace hotpath::schedule_abstraction_test
