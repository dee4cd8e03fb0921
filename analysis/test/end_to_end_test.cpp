// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "task_sets.hpp"

namespace hotpath::end_to_end_test {

const PeriodicTasks kTasks = {task(1, 10), task(2, 20)};
const ResponseTimes kBounds = {1, 3};
const TaskChain kForward = {0, 1}, kReversed = {1, 0};

TEST(E2EEvaluationSelfChecks, Davare) {
  EXPECT_EQ(davare_2007(kTasks, kBounds, kForward), 34);
  EXPECT_EQ(davare_2007(kTasks, kBounds, kReversed), 34);
}

TEST(E2EEvaluationSelfChecks, Duerr) {
  EXPECT_EQ(duerr_2019_reaction_time(kTasks, kBounds, kForward), 33);
  EXPECT_EQ(duerr_2019_reaction_time(kTasks, kBounds, kReversed), 34);
}

TEST(E2EEvaluationSelfChecks, PeriodicImplicit) {
  EXPECT_EQ(kloda_2018(kTasks, kBounds, kForward), 23);
  EXPECT_EQ(kloda_2018(kTasks, kBounds, kReversed), 31);
  EXPECT_EQ(guenzel_2023(kTasks, kBounds, kForward), 23);
  EXPECT_EQ(guenzel_2023(kTasks, kBounds, kReversed), 31);
}

TEST(E2EEvaluationSelfChecks, LogicalExecutionTimeIsTheDeadlineAsResponseTime) {
  const PeriodicTasks tasks = {task(1, 10, 7), task(1, 20, 8)};
  const ResponseTimes deadlines = {7, 8};
  EXPECT_EQ(guenzel_2023(tasks, deadlines, kForward, Priorities::dynamic), 38);
  EXPECT_EQ(guenzel_2023(tasks, deadlines, kReversed, Priorities::dynamic), 37);
  EXPECT_EQ(davare_2007(tasks, deadlines, kForward), 45) << "Hamann 2017";
  EXPECT_EQ(davare_2007(tasks, deadlines, kReversed), 45) << "Hamann 2017";
}

TEST(Davare2007, ChainsOfThePaperArtifact) {
  const PeriodicTasks tasks = {task(1, 10), task(2, 20), task(4, 20), task(8, 50), task(16, 100)};
  const ResponseTimes bounds = {17, 20, 27, 40, 40};
  EXPECT_EQ(davare_2007(tasks, bounds, {0, 1}), 67);
  EXPECT_EQ(davare_2007(tasks, bounds, {4, 3, 0}), 257);
  EXPECT_EQ(davare_2007(tasks, bounds, {0, 1, 2, 3, 4}), 344);
  EXPECT_EQ(davare_2007(tasks, bounds, {2, 0}), 74);
  EXPECT_EQ(davare_2007(tasks, bounds, {4, 4}), 280);
}

TEST(Duerr2019, Theorem54TakesALongResponseTimeInPlaceOfAShortPeriod) {
  EXPECT_EQ(duerr_2019_reaction_time({task(1, 30), task(1, 20)}, {25, 3}, kForward), 30 + 3 + 25);
}

TEST(Duerr2019, DynamicPrioritiesAlwaysPayTheHandoverDelay) {
  EXPECT_EQ(duerr_2019_reaction_time(kTasks, kBounds, kForward, Priorities::dynamic), 10 + 3 + 20 + 1);
}

TEST(Duerr2019, ReleaseJitterOfTheProducerPaysTheHandoverDelay) {
  PeriodicTasks tasks = kTasks;
  tasks[0].jitter = 1;
  EXPECT_EQ(duerr_2019_reaction_time(tasks, {2, 3}, kForward), 10 + 3 + 20 + 2);
}

TEST(Guenzel2023, AGoodPhaseShortensAndABadOneLengthensTheSynchronousLatency) {
  PeriodicTasks tasks = kTasks;
  tasks[0].phase = 3;
  // From task 2 (releases 0, 20, ...), finished within 3, to task 1 (releases 3, 13, ...).
  EXPECT_EQ(guenzel_2023(tasks, kBounds, kReversed), 20 + 3 + 1);
  tasks[0].phase = 2;
  EXPECT_EQ(guenzel_2023(tasks, kBounds, kReversed), 20 + 12 + 1);
  EXPECT_THROW(kloda_2018(tasks, kBounds, kReversed), AnalysisError);
}

TEST(Guenzel2023, WithoutPhasesEqualsKloda2018) {
  RandomStream random(11, {0});
  for (int i = 0; i < 1000; ++i) {
    const PeriodicTasks tasks = random_tasks(random, {});
    ResponseTimes bounds;
    TaskChain chain;
    for (const PeriodicTask& t : tasks)
      bounds.push_back(t.wcet + static_cast<std::int64_t>(random.below(40)));
    for (std::size_t n = 1 + random.below(5); n > 0; --n) chain.push_back(random.below(tasks.size()));
    for (const Priorities p : {Priorities::fixed, Priorities::dynamic}) {
      EXPECT_EQ(guenzel_2023(tasks, bounds, chain, p), kloda_2018(tasks, bounds, chain, p))
          << as_graph(tasks) << as_text(chain);
    }
  }
}

}  // namespace hotpath::end_to_end_test
