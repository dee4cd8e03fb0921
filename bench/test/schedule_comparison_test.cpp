// SPDX-License-Identifier: Apache-2.0
// The comparison of two schedules of one task set.
#include "validation/validation.hpp"

#include <gmock/gmock.h>

#include "simulated/own_times.hpp"

namespace hotpath::schedule_comparison_test {

using namespace std::chrono_literals;
using testing::FieldsAre;

Time at(Duration d) { return Time{} + d; }

TaskSet timers(const std::vector<Duration>& periods) {
  TaskSet set;
  for (const Duration period : periods) {
    Task& task = set.tasks.emplace_back();
    task.name = "T" + std::to_string(set.size() - 1);
    task.period = task.deadline = period;
  }
  return set;
}

/// Consecutive jobs of 1 ms.
results::Schedule in_order(const TaskSet& set, const std::vector<TaskId>& tasks) {
  results::Schedule s{set, {}};
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const Time start = at(static_cast<std::int64_t>(i) * 1ms);
    results::ExecutedJob& executed = s.jobs.emplace_back();
    executed.job.task = tasks[i];
    executed.job.timestamp = executed.start = start;
    executed.finish = start + 1ms;
    executed.next_call = start + set[tasks[i]].period;
  }
  return s;
}

TEST(ScheduleComparison, SimilarityIsTwiceTheCommonSubsequenceOverBothLengths) {
  const TaskSet set = timers({10ms, 20ms, 20ms});
  const results::Schedule a = in_order(set, {0, 1, 2, 0, 1, 2});
  EXPECT_EQ(validation::compare_schedules(a, a).similarity, 1);
  EXPECT_FALSE(validation::compare_schedules(a, a).first_difference);
  // Of 0 1 2 0 1 2 and 0 1 0 2 1 2 five tasks are common in order: 0 1 2 1 2.
  const validation::ScheduleComparison c =
      validation::compare_schedules(a, in_order(set, {0, 1, 0, 2, 1, 2}));
  EXPECT_DOUBLE_EQ(c.similarity, 10.0 / 12);
  ASSERT_TRUE(c.first_difference);
  EXPECT_THAT(*c.first_difference, FieldsAre(2U, 2, "T2", "T0"));
}

TEST(ScheduleComparison, OrderAmongEqualPeriodsCanBeLeftOut) {
  const TaskSet set = timers({10ms, 20ms, 20ms});
  const validation::ScheduleComparison c =
      validation::compare_schedules(in_order(set, {0, 1, 2, 0}), in_order(set, {0, 2, 1, 0}));
  EXPECT_LT(c.similarity, 1);
  EXPECT_EQ(c.similarity_by_period, 1);
}

TEST(ScheduleComparison, LostJobsCountAgainstTheTimestampsReached) {
  const TaskSet set = timers({1ms, 100ms});
  // T0 has timestamps at 0 to 9 ms; the first schedule runs it five times, the second always.
  const validation::ScheduleComparison c = validation::compare_schedules(
      in_order(set, {0, 1, 0, 1, 0, 1, 0, 1, 1, 0}), in_order(set, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  // The comparison includes one millisecond after the last start, and so the timestamp at 10 ms.
  EXPECT_NEAR(c.measured.lost_percent.at("T0"), 100 * (1 - 5.0 / 11), 1e-9);
  EXPECT_NEAR(c.other.lost_percent.at("T0"), 100 * (1 - 10.0 / 11), 1e-9);
  EXPECT_EQ(c.largest_loss_difference_percent,
            100);  // T1: only the first schedule serves its one timestamp
}

JobRecord timer_job(TaskId task, std::uint64_t sequence, Duration timestamp, Duration start,
                    Duration finish) {
  return {{task, sequence, at(timestamp), at(timestamp), kNever, {}}, at(start), at(finish)};
}

TEST(OwnTimes, TimeOfTheRaisedThreadIsNotThatOfTheJobItDisplaces) {
  Trace trace;
  trace.jobs = {timer_job(0, 0, 0ms, 0ms, 10ms), timer_job(1, 0, 4ms, 4ms, 7ms)};
  trace.jobs[1].worker = 1;
  const Trace one = simulated::with_own_times(trace, 1, 1);
  EXPECT_EQ(one.jobs[0].finish - one.jobs[0].start, 7ms);
  EXPECT_EQ(one.jobs[1].finish - one.jobs[1].start, 3ms);
  const Trace two = simulated::with_own_times(trace, 2, 1);
  EXPECT_EQ(two.jobs[0].finish - two.jobs[0].start, 10ms);
  const Trace equal = simulated::with_own_times(trace, 1, std::nullopt);
  EXPECT_EQ(equal.jobs[0].finish - equal.jobs[0].start, 8500us);
  EXPECT_EQ(equal.jobs[1].finish - equal.jobs[1].start, 1500us);
  trace.jobs[0].cpu_time = 6900us;
  EXPECT_EQ(simulated::with_own_times(trace, 1, 1).jobs[0].finish, at(6900us));
}

TEST(OwnCosts, AreTheGapsBeforeJobsThatWereDue) {
  Trace trace;
  // One job woken 120 us late, two waiting jobs after gaps of 10 and 30 us, one on another thread
  // during a job.
  trace.jobs = {timer_job(0, 0, 0ms, 0ms, 1ms), timer_job(0, 1, 10ms, 10120us, 20ms),
                timer_job(1, 0, 15ms, 15ms, 16ms), timer_job(0, 2, 20ms, 20010us, 25ms),
                timer_job(1, 1, 20ms, 25030us, 26ms)};
  trace.jobs[2].worker = 1;
  EXPECT_THAT(simulated::own_costs(trace, 1), FieldsAre(20us, 100us));
  trace.jobs[4].worker = 1;  // a sleeping thread on its own core, woken 5 ms late
  EXPECT_THAT(simulated::own_costs(trace, 2), FieldsAre(10us, 5030us - 10us));
  EXPECT_EQ(simulated::own_costs(Trace{}, 1).dispatch, 0us);
}

}  // namespace hotpath::schedule_comparison_test
