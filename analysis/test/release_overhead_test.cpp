// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/release_overhead.hpp"

#include <gmock/gmock.h>

#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "task_sets.hpp"

namespace hotpath::release_overhead_test {

constexpr std::int64_t kDelta = 120 * kUs;

TEST(SectionVB, ReleaseOnlyFixedPointOfTheFacts) {
  const struct {
    std::int64_t wcet, t0, overhead;
  } rows[] = {{1000, 1840, 840},   {16000, 16840, 840}, {29000, 29840, 840},
              {29200, 30160, 960}, {29500, 30460, 960}, {83900, 85460, 1560}};
  for (const auto& row : rows) {
    PeriodicTasks tasks = paper_timers_only(60);
    tasks[6].wcet = tasks[6].bcet = row.wcet * kUs;
    const auto overhead = release_overhead_ro(tasks, 6, kDelta);
    ASSERT_TRUE(overhead) << row.wcet;
    EXPECT_EQ(overhead->t0, row.t0 * kUs) << row.wcet;
    EXPECT_EQ(overhead->overhead, row.overhead * kUs) << row.wcet;
  }
}

TEST(SectionVB, ReleaseOnlyDivergesWhenReleasesAloneFillTheProcessor) {
  EXPECT_FALSE(release_overhead_ro({task(1, 10), task(1, 10)}, 0, 5));
  EXPECT_TRUE(release_overhead_ro({task(1, 10), task(1, 10)}, 0, 4));
  EXPECT_THROW(with_release_overhead({task(1, 10), task(1, 10)}, 5, ReleaseMode::release_only, brueggen_2015),
               AnalysisError);
}

TEST(SectionVB, TighteningNeedsAScheduleProvenWithTheUntightenedOverhead) {
  // Task 2 spans two releases of task 1, which cost 2 delta, and its own release.
  const PeriodicTasks schedulable_set = {task(1, 20), task(18, 100)};
  const auto tight = with_release_overhead(
      schedulable_set, 1, ReleaseMode::release_only,
      [](const PeriodicTasks& tasks) { return ResponseTimes(tasks.size(), tasks[1].wcet); });
  EXPECT_EQ(release_overhead_ro(schedulable_set, 1, 1)->overhead, 2);
  EXPECT_TRUE(tight.tightened);

  const PeriodicTasks long_job = {task(1, 20), task(19, 100)};
  EXPECT_EQ(release_overhead_ro(long_job, 1, 1)->overhead, 3);
  const auto loose = with_release_overhead(long_job, 1, ReleaseMode::release_only, brueggen_2015);
  EXPECT_FALSE(loose.tightened);
  EXPECT_EQ(loose.tasks[1].wcet, 22);
  EXPECT_EQ(loose.bounds[0], std::nullopt);
}

TEST(SectionVB, TighteningNeedsConstrainedDeadlines) {
  const auto analysis = [](const PeriodicTasks& tasks) { return ResponseTimes(tasks.size(), 1); };
  EXPECT_FALSE(with_release_overhead({task(1, 20, 30), task(2, 40)}, 1, ReleaseMode::release_only, analysis)
                   .tightened);
  EXPECT_TRUE(with_release_overhead({task(1, 20, 20), task(2, 40)}, 1, ReleaseMode::release_only, analysis)
                  .tightened);
}

TEST(SectionVB, PaperTaskSetsGetTheSameBoundsInBothModes) {
  for (const int utilisation : {60, 80, 90}) {
    const PeriodicTasks tasks = paper_timers_only(utilisation);
    const auto ro = with_release_overhead(tasks, kDelta, ReleaseMode::release_only, brueggen_2015);
    const auto re = with_release_overhead(tasks, kDelta, ReleaseMode::release_and_execute, brueggen_2015);
    EXPECT_TRUE(schedulable(ro.tasks, ro.bounds));
    EXPECT_EQ(ro.bounds, re.bounds);
  }
}

TEST(ConditionC1, ReleaseAndExecuteRefusesAJobAsLongAsAnotherTasksPeriod) {
  const PeriodicTasks tasks = {task(1, 20), task(18, 100)};
  EXPECT_THROW(with_release_overhead(tasks, 1, ReleaseMode::release_and_execute, brueggen_2015),
               AnalysisError);
  EXPECT_NO_THROW(with_release_overhead({task(1, 20), task(17, 100)}, 1, ReleaseMode::release_and_execute,
                                        brueggen_2015));
}

}  // namespace hotpath::release_overhead_test
