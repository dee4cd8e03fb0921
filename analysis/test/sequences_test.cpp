// SPDX-License-Identifier: Apache-2.0
// Section VI: sequences timer -> subscription -> subscription as tasks with preemption points.
#include <gmock/gmock.h>

#include "hotpath/analysis/buttazzo_2013.hpp"
#include "hotpath/analysis/chen_2019.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "task_sets.hpp"

namespace hotpath {
namespace {

using ::testing::ElementsAre;
constexpr auto kNone = std::nullopt;

SequenceTask sequence(std::vector<std::int64_t> segments, std::int64_t period, std::int64_t deadline = 0,
                      std::int64_t suspension = 0) {
  return {.name = "s",
          .segments = std::move(segments),
          .period = period,
          .deadline = deadline > 0 ? deadline : period,
          .suspension = suspension};
}

TEST(LimitedPreemption, ResponseTimeAnalysisCrateLpFp) {
  EXPECT_THAT(buttazzo_2013({sequence({2, 2}, 12), sequence({3, 3}, 20), sequence({1, 4, 3}, 40)},
                            TimeModel::discrete),
              ElementsAre(7, 13, 22));
}

TEST(LimitedPreemption, ResponseTimeAnalysisCrateLpFpOverload) {
  EXPECT_THAT(buttazzo_2013({sequence({2, 2}, 12), sequence({3, 3}, 20), sequence({1, 4, 3}, 21)},
                            TimeModel::discrete),
              ElementsAre(7, 13, kNone));
}

TEST(LimitedPreemption, ResponseTimeAnalysisCrateFloatingNonPreemptiveIsALastPartOfOneUnit) {
  EXPECT_THAT(buttazzo_2013({sequence({2, 1, 1}, 12), sequence({3, 2, 1}, 20), sequence({4, 3, 1}, 40)},
                            TimeModel::discrete),
              ElementsAre(7, 17, 32));
}

TEST(LimitedPreemption, SchedcatPreemptiveFpIsAllPartsOfOneUnit) {
  EXPECT_THAT(
      buttazzo_2013({sequence({1}, 4), sequence({1}, 5), sequence({1, 1, 1}, 9), sequence({1, 1, 1}, 18)},
                    TimeModel::discrete),
      ElementsAre(1, 2, 7, 18));
}

TEST(LimitedPreemption, OneSegmentEachIsExactNpFp) {
  RandomStream random(5, {0});
  for (int i = 0; i < 500; ++i) {
    const PeriodicTasks tasks = random_tasks(random, {});
    SequenceTasks whole;
    for (const PeriodicTask& t : tasks) whole.push_back(sequence({t.wcet}, t.period));
    for (const TimeModel model : {TimeModel::continuous, TimeModel::discrete}) {
      EXPECT_EQ(buttazzo_2013(whole, model), davis_2007(tasks, model)) << as_graph(tasks);
    }
  }
}

TEST(LimitedPreemption, RefusesSuspensionThatChen2019Takes) {
  const SequenceTasks tasks = {sequence({1, 1}, 10, 10, 2)};
  EXPECT_THROW(buttazzo_2013(tasks), AnalysisError);
  EXPECT_THAT(chen_2019(tasks), ElementsAre(4));
}

TEST(SelfSuspension, EveryGapLetsALowerPriorityPartIn) {
  // t = 2 + 3 + 2 * 4; t = 5 + ceil((t + 13 - 2) / 50) * 2.
  EXPECT_THAT(chen_2019({sequence({1, 1}, 50, 50, 3), sequence({4, 1}, 100)}), ElementsAre(13, 7));
}

TEST(SelfSuspension, SuspensionOfAHigherPriorityTaskIsJitter) {
  // t = 5 + ceil((t + 8 - 2) / 10) * 2: two jobs of task 1 in 9.
  EXPECT_THAT(chen_2019({sequence({1, 1}, 10, 10, 6), sequence({5}, 100)}), ElementsAre(kNone, kNone));
  EXPECT_THAT(chen_2019({sequence({1, 1}, 20, 20, 6), sequence({5}, 100)}), ElementsAre(18, 9));
}

TEST(SequenceTasks, FollowTheTimersOfATaskSet) {
  TaskSet set;
  const auto add = [&](std::string name, TaskKind kind, int period, int wcet, std::vector<TaskId> feeds) {
    Task t;
    t.name = std::move(name);
    t.kind = kind;
    t.period = Duration(period);
    t.deadline = Duration(period);
    t.wcet = Duration(wcet);
    t.feeds = std::move(feeds);
    set.tasks.push_back(t);
  };
  add("a", TaskKind::timer, 100, 1, {1});
  add("b/a", TaskKind::subscription, 0, 2, {2});
  add("c/b", TaskKind::subscription, 0, 3, {});
  add("d", TaskKind::timer, 50, 4, {});
  const SequenceTasks tasks = sequence_tasks(set, Policy::rm);
  ASSERT_EQ(tasks.size(), 2U);
  EXPECT_EQ(tasks[0].name, "d");
  EXPECT_THAT(tasks[1].segments, ElementsAre(1, 2, 3));
  EXPECT_EQ(tasks[1].id, 0U);

  set.tasks[3].feeds = {2};
  EXPECT_THROW(sequence_tasks(set, Policy::rm), AnalysisError) << "subscription with two publishers";
  set.tasks[3].feeds = {};
  set.tasks[0].feeds = {1, 2};
  EXPECT_THROW(sequence_tasks(set, Policy::rm), AnalysisError) << "timer that feeds two";
  set.tasks[0].feeds = {};
  set.tasks[2].feeds = {1};
  EXPECT_THROW(sequence_tasks(set, Policy::rm), AnalysisError) << "circle without a timer";
}

}  // namespace
}  // namespace hotpath
