// SPDX-License-Identifier: Apache-2.0
// Published and recomputed values of the non-preemptive analyses on one processor.
#include <gmock/gmock.h>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "task_sets.hpp"

namespace hotpath::non_preemptive_test {

using ::testing::ElementsAre;

constexpr auto kNone = std::nullopt;

PeriodicTasks paper_set(int utilisation, std::int64_t overhead) {
  PeriodicTasks tasks = paper_timers_only(utilisation);
  for (PeriodicTask& t : tasks) t.wcet += overhead;
  return tasks;
}

std::vector<double> milliseconds(const ResponseTimes& bounds) {
  std::vector<double> ms;
  for (const auto& b : bounds) ms.push_back(b ? static_cast<double>(*b) / 1e6 : -1);
  return ms;
}

TEST(TableI, AllNineEntriesToAHundredthOfAMillisecondWithDelta0119) {
  for (const WcrtColumn& column : wcrt_table(kPaperDelta)) {
    SCOPED_TRACE(column.utilisation_percent);
    EXPECT_NEAR(static_cast<double>(*column.imu) / 1e6, column.printed_ms[0], 0.00501);
    EXPECT_NEAR(static_cast<double>(*column.camera) / 1e6, column.printed_ms[1], 0.00501);
    EXPECT_NEAR(static_cast<double>(*column.lidar) / 1e6, column.printed_ms[2], 0.00501);
  }
}

TEST(TableI, TheRoundedDeltaOfTheTextMissesEntries) {
  const auto table = wcrt_table(120'000);
  EXPECT_EQ(*table[1].camera, 75'720'000);
  EXPECT_EQ(*table[2].lidar, 167'440'000);
}

TEST(TableI, ADivergingReleaseCostLeavesNoBound) { EXPECT_EQ(wcrt_table(20'000'000)[0].imu, kNone); }

struct TableRow {
  int utilisation;
  std::int64_t overhead;
  std::vector<double> ms;
};

TEST(Theorem1, PaperTaskSetsForEveryOverheadOfTheFacts) {
  const TableRow rows[] = {
      {60, 833'000, {12.666, 23.499, 36.165, 46.998, 57.831, 70.497, 70.497}},
      {80, 833'000, {16.666, 33.332, 48.165, 64.831, 75.664, 149.495, 149.495}},
      {90, 833'000, {18.666, 37.332, 54.165, 72.831, 83.664, 167.328, 167.328}},
      {60, 840'000, {12.68, 23.52, 36.20, 47.04, 57.88, 70.56, 70.56}},
      {80, 840'000, {16.68, 33.36, 48.20, 64.88, 75.72, 149.60, 149.60}},
      {90, 840'000, {18.68, 37.36, 54.20, 72.88, 83.72, 167.44, 167.44}},
      {60, 0, {11, 21, 32, 42, 52, 63, 63}},
      {80, 0, {15, 29, 44, 58, 69, 79, 79}},
      {90, 0, {17, 34, 50, 67, 77, 154, 154}},
  };
  for (const TableRow& row : rows) {
    SCOPED_TRACE(testing::Message() << row.utilisation << " % with " << row.overhead << " ns");
    const std::vector<double> ms = milliseconds(brueggen_2015(paper_set(row.utilisation, row.overhead)));
    ASSERT_EQ(ms.size(), row.ms.size());
    for (std::size_t i = 0; i < ms.size(); ++i) EXPECT_DOUBLE_EQ(ms[i], row.ms[i]) << "task " << i;
  }
}

TEST(Theorem1, ATaskWhoseFixedPointLiesBeyondItsDeadlineHasNoBound) {
  EXPECT_THAT(brueggen_2015({task(1, 10), task(2, 20), task(4, 20), task(8, 50), task(16, 100)}),
              ElementsAre(kNone, 20, kNone, 40, 40));
}

TEST(PaperTaskSets, UnderEachPolicyWithTheOverheadOfTheFacts) {
  const auto davis = [](const PeriodicTasks& tasks) { return davis_2007(tasks); };
  const auto spuri = [](const PeriodicTasks& tasks) { return spuri_1996(tasks); };
  const auto fifo = [](const PeriodicTasks& tasks) { return ResponseTimes(7, bedarkar_2022(tasks)); };
  const struct {
    int utilisation;
    ResponseTimes (*analysis)(const PeriodicTasks&);
    std::vector<double> ms;
  } rows[] = {
      {60, davis, {12.666, 23.499, 34.332, 46.998, 57.831, 68.664, 68.664}},
      {80, davis, {16.666, 31.499, 48.165, 62.998, 73.831, 86.497, 86.497}},
      {90, davis, {18.666, 35.499, 54.165, 70.998, 83.664, 94.497, 94.497}},
      {60, spuri, {12.666, 57.831, 57.831, 57.831, 57.831, 68.664, 68.664}},
      {80, spuri, {19.831, 73.831, 73.831, 73.831, 73.831, 86.497, 86.497}},
      {90, spuri, {27.831, 81.831, 81.831, 81.831, 81.831, 94.497, 94.497}},
      {60, fifo, std::vector<double>(7, 66.831)},
      {80, fifo, std::vector<double>(7, 82.831)},
      {90, fifo, std::vector<double>(7, 90.831)},
  };
  for (const auto& row : rows)
    EXPECT_EQ(milliseconds(row.analysis(paper_set(row.utilisation, 833'000))), row.ms) << row.utilisation;
}

TEST(ExactNpFp, ResponseTimeAnalysisCrateFpNpRta1) {
  const PeriodicTasks tasks = {task(20, 70), task(20, 80), task(35, 200)};
  EXPECT_THAT(davis_2007(tasks, TimeModel::discrete), ElementsAre(54, 74, 75));
  EXPECT_THAT(davis_2007(tasks, TimeModel::continuous), ElementsAre(55, 75, 75));
}

TEST(ExactNpFp, ResponseTimeAnalysisCrateFpNpRtaOverload) {
  EXPECT_THAT(davis_2007({task(10, 20), task(20, 50), task(30, 200)}, TimeModel::discrete),
              ElementsAre(39, 79, kNone));
}

TEST(ExactNpFp, Davis2007CounterexampleHasItsWorstCaseInTheSecondInstance) {
  const PeriodicTasks tasks = {task(100, 250, 250), task(100, 350, 325), task(100, 350, 325)};
  const ResponseTimes bounds = davis_2007(tasks);
  EXPECT_THAT(bounds, ElementsAre(200, 300, 350));
  EXPECT_FALSE(schedulable(tasks, bounds));
  EXPECT_THAT(brueggen_2015(tasks), ElementsAre(200, kNone, kNone));
}

TEST(ExactNpFp, SupremumIsBelowTheClosedFormWhereReleasesTieWithTheEndOfBlocking) {
  EXPECT_EQ(davis_2007({task(1, 4), task(1, 5), task(3, 9)})[1], 5);
}

TEST(ExactNpFp, FullUtilisationIsBoundedOnlyWithoutBlocking) {
  EXPECT_THAT(davis_2007({task(1, 2), task(2, 4)}), ElementsAre(3, 3));
  EXPECT_THAT(davis_2007({task(2, 4), task(2, 4), task(1, 100)}), ElementsAre(4, kNone, kNone));
  PeriodicTasks jittery = {task(1, 2), task(2, 4)};
  jittery[0].jitter = 1;
  EXPECT_EQ(davis_2007(jittery)[1], kNone);
}

TEST(ExactNpFp, JitterOfAHigherPriorityTaskBringsItsJobsTogether) {
  PeriodicTasks tasks = {task(2, 10), task(3, 20)};
  EXPECT_THAT(davis_2007(tasks), ElementsAre(5, 5));
  tasks[0].jitter = 9;
  EXPECT_THAT(davis_2007(tasks), ElementsAre(14, 7));
}

TEST(NpEdfWcrt, ResponseTimeAnalysisCrateSameDeadlines) {
  EXPECT_THAT(spuri_1996({task(79, 120, 100), task(11, 34, 100), task(1, 190, 100)}, TimeModel::discrete),
              ElementsAre(91, 91, 91));
}

TEST(NpEdfWcrt, ResponseTimeAnalysisCrateDifferentDeadlines) {
  EXPECT_THAT(spuri_1996({task(79, 120, 50), task(11, 34, 100), task(1, 190, 120)}, TimeModel::discrete),
              ElementsAre(89, 90, 121));
}

TEST(Fifo, ResponseTimeAnalysisCrateExample1) {
  EXPECT_EQ(bedarkar_2022({task(79, 120), task(11, 34), task(1, 190)}), 91);
}

TEST(Fifo, ResponseTimeAnalysisCrateOverloadIsRefused) {
  EXPECT_THROW(bedarkar_2022({task(2, 4), task(2, 8), task(4, 12)}), AnalysisError);
}

}  // namespace hotpath::non_preemptive_test
