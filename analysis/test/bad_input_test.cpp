// SPDX-License-Identifier: Apache-2.0
// Messages for invalid input.
#include <gmock/gmock.h>

#include <functional>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/release_overhead.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "task_sets.hpp"

namespace hotpath::bad_input_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const AnalysisError& e) {
    return e.what();
  }
  return "accepted";
}

PeriodicTasks named() {
  PeriodicTasks tasks = {task(1, 10), task(2, 20)};
  tasks[0].name = "imu";
  tasks[1].name = "lidar";
  return tasks;
}

TEST(BadInput, TimesOutOfRangeNameTheTask) {
  const auto with = [](auto change) {
    PeriodicTasks tasks = named();
    change(tasks[1]);
    return refusal([&] { davis_2007(tasks); });
  };
  EXPECT_THAT(with([](PeriodicTask& t) { t.wcet = 0; }),
              AllOf(HasSubstr("'lidar'"), HasSubstr("execution time 0 ns is not positive")));
  EXPECT_THAT(with([](PeriodicTask& t) { t.period = -5; }), HasSubstr("period -5 ns is not positive"));
  EXPECT_THAT(with([](PeriodicTask& t) { t.deadline = 0; }), HasSubstr("deadline 0 ns is not positive"));
  EXPECT_THAT(with([](PeriodicTask& t) { t.bcet = 3; }), HasSubstr("outside of 0 to 2 ns"));
  EXPECT_THAT(with([](PeriodicTask& t) { t.jitter = -1; }), HasSubstr("jitter -1 ns is negative"));
  EXPECT_THAT(with([](PeriodicTask& t) { t.phase = -1; }), HasSubstr("phase -1 ns is negative"));
  EXPECT_THAT(refusal([] { davis_2007({}); }), HasSubstr("empty"));
}

TEST(BadInput, ADeadlineBeyondThePeriodNamesAMethodThatAcceptsIt) {
  PeriodicTasks tasks = named();
  tasks[1].deadline = 21;
  EXPECT_THAT(refusal([&] { brueggen_2015(tasks); }), AllOf(HasSubstr("'lidar'"), HasSubstr("Theorem 1"),
                                                            HasSubstr("davis_2007 (exact NP-FP) would")));
  EXPECT_EQ(refusal([&] { davis_2007(tasks); }), "accepted");
}

TEST(BadInput, JitterIsRefusedWhereTheMethodHasNone) {
  PeriodicTasks tasks = named();
  tasks[0].jitter = 1;
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { brueggen_2015(tasks); }, [&] { spuri_1996(tasks); }, [&] { bedarkar_2022(tasks); }}) {
    EXPECT_THAT(refusal(call), HasSubstr("release jitter 1 ns"));
  }
}

TEST(BadInput, UtilisationAboveOneNamesTheMethodThatStillAnswers) {
  const PeriodicTasks tasks = {task(6, 10), task(6, 10)};
  EXPECT_THAT(refusal([&] { spuri_1996(tasks); }),
              AllOf(HasSubstr("1.2"), HasSubstr("spuri_1996"), HasSubstr("davis_2007")));
  EXPECT_THAT(refusal([&] { bedarkar_2022(tasks); }), HasSubstr("above 1"));
}

TEST(BadInput, ChainsHaveUnknownTasks) {
  EXPECT_THAT(refusal([&] { davare_2007(named(), {1, 2}, {0, 2}); }), HasSubstr("only 2"));
  EXPECT_THAT(refusal([&] {
                davare_2007(named(), {1, std::nullopt}, {0, 1});
              }),
              AllOf(HasSubstr("'lidar'"), HasSubstr("no response time bound")));
  EXPECT_THAT(refusal([&] { davare_2007(named(), {1}, {0}); }),
              HasSubstr("1 response time bounds for 2 tasks"));
  EXPECT_THAT(refusal([&] { davare_2007(named(), {1, 2}, {}); }), HasSubstr("empty"));
}

TEST(BadInput, HyperperiodsThatOverflowOrExplodeNameTheMethodsWithout) {
  PeriodicTasks tasks = {task(1, 4'611'686'018'427'387'847), task(1, 4'611'686'018'427'387'846)};
  EXPECT_THAT(refusal([&] {
                kloda_2018(tasks, {1, 2}, {0, 1});
              }),
              AllOf(HasSubstr("hyperperiod exceeds"), HasSubstr("duerr_2019")));
  tasks = {task(1, 10'000'019), task(1, 10'000'079)};
  EXPECT_THAT(refusal([&] { kloda_2018(tasks, {1, 2}, {0, 1}); }), HasSubstr("10000079 releases"));
}

TEST(BadInput, TimesThatOverflowAreReported) {
  const std::int64_t huge = std::numeric_limits<std::int64_t>::max() / 2;
  const PeriodicTasks tasks = {task(huge / 2, huge), task(huge / 2, huge), task(huge / 2, huge)};
  EXPECT_THAT(refusal([&] {
                davare_2007(tasks, {huge, huge, huge}, {0, 1, 2});
              }),
              HasSubstr("64-bit nanoseconds"));
}

TEST(BadInput, SubscriptionsAreNotPeriodicTasks) {
  TaskSet set;
  set.tasks.resize(1);
  set.tasks[0].name = "planner/map";
  set.tasks[0].kind = TaskKind::subscription;
  EXPECT_THAT(refusal([&] { periodic_tasks(set, Policy::rm); }),
              HasSubstr("'planner/map' is a subscription"));
}

TEST(BadInput, OtherBoundaries) {
  EXPECT_THAT(refusal([] { with_release_overhead(named(), -1, ReleaseMode::release_only, brueggen_2015); }),
              HasSubstr("-1 ns is negative"));
  EXPECT_THAT(refusal([] { paper_timers_only(70); }), HasSubstr("60, 80 or 90"));
}

TEST(PeriodicTasks, ComeInPriorityOrderOfTheTaskSet) {
  TaskSet set;
  for (const int period : {30, 10, 10, 20}) {
    Task t;
    t.name = "t" + std::to_string(set.size());
    t.period = t.deadline = Duration(period);
    t.wcet = Duration(2);
    t.bcet = Duration(1);
    t.phase = Duration(3);
    t.priority = -static_cast<std::int64_t>(set.size());
    set.tasks.push_back(t);
  }
  const auto ids = [&](Policy policy) {
    std::vector<TaskId> order;
    for (const PeriodicTask& t : periodic_tasks(set, policy)) order.push_back(t.id);
    return order;
  };
  EXPECT_EQ(ids(Policy::rm), (std::vector<TaskId>{1, 2, 3, 0}));
  EXPECT_EQ(ids(Policy::fp), (std::vector<TaskId>{3, 2, 1, 0}));
  EXPECT_EQ(ids(Policy::edf), (std::vector<TaskId>{0, 1, 2, 3}));
  const PeriodicTask first = periodic_tasks(set, Policy::rm)[0];
  EXPECT_EQ(first.name, "t1");
  EXPECT_EQ(std::tuple(first.wcet, first.bcet, first.period, first.deadline, first.phase),
            std::tuple(2, 1, 10, 10, 3));
}

}  // namespace hotpath::bad_input_test
