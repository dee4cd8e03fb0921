// SPDX-License-Identifier: Apache-2.0
// Timestamps and next calls of executed jobs, from traces of hotpath and of the real ROS 2 stack.
#include "results/schedule.hpp"

#include <gtest/gtest.h>

namespace hotpath::schedule_test {

using namespace std::chrono_literals;

constexpr Time kEpoch = from_ns(7'000'000'000);

TaskSet one_timer() {
  TaskSet set;
  Task& timer = set.tasks.emplace_back();
  timer.name = "IMU";
  timer.period = timer.deadline = 10ms;
  timer.phase = 2ms;
  return set;
}

/// A job that is ready and released at its timestamp.
JobRecord job(Duration timestamp, Duration start, Outcome outcome = Outcome::ran) {
  const Time ready = kEpoch + timestamp, begin = kEpoch + start;
  return {{0, 0, ready, ready, kNever, {}}, begin, begin + 3ms, Duration(-1), outcome};
}

results::Schedule schedule_of(std::vector<JobRecord> jobs) {
  Trace trace;
  trace.epoch = kEpoch;
  trace.jobs = std::move(jobs);
  return results::schedule_of(one_timer(), trace);
}

TEST(Schedule, TheNextCallFollowsTheLatestReleaseAtTheStart) {
  // The job with timestamp 12 ms waits when the first one starts, and never runs.
  const results::Schedule schedule =
      schedule_of({job(2ms, 13ms), job(12ms, 0ms, Outcome::queued), job(22ms, 25ms, Outcome::running)});
  ASSERT_EQ(schedule.jobs.size(), 2U);
  EXPECT_EQ(schedule.jobs[0].job.timestamp, Time{} + 2ms);
  EXPECT_EQ(schedule.jobs[0].next_call, Time{} + 22ms);
  EXPECT_EQ(schedule.jobs[0].response_time(), 14ms);
  EXPECT_EQ(results::response_authors(schedule, schedule.jobs[0]), 4ms);
  EXPECT_EQ(schedule.jobs[1].outcome, Outcome::running);
}

/// The call of a wait set's timer releases the job that it starts.
TEST(Schedule, SkippedTimestampsMoveTheNextCall) {
  JobRecord late = job(2ms, 26ms);
  late.job.release = late.start;
  late.job.skipped = 2;
  EXPECT_EQ(schedule_of({late}).jobs.at(0).next_call, Time{} + 32ms);
}

TEST(Schedule, IsSortedByStart) {
  const results::Schedule schedule = schedule_of({job(12ms, 13ms), job(2ms, 3ms)});
  ASSERT_EQ(schedule.jobs.size(), 2U);
  EXPECT_EQ(schedule.jobs[0].start, Time{} + 3ms);
}

/// The second job starts after the timestamps 12 and 22 ms; the timer's own call skips the first one
/// of them, a releaser has released both.
TEST(Schedule, GoldenJobsHaveTheTimestampOfTheirCallOrOfTheirNumber) {
  GoldenTrace golden{one_timer(), {}};
  golden.jobs = {
      {.task = 0, .count = 0, .start = Time{} + 2ms, .finish = Time{} + 21ms, .next_call = Time{} + 12ms},
      {.task = 0, .count = 1, .start = Time{} + 23ms, .finish = Time{} + 24ms, .next_call = Time{} + 32ms},
      {.task = 0, .count = 2, .start = Time{} + 33ms, .finish = Time{} + 34ms, .next_call = Time{} + 42ms}};
  const auto timestamp = [&](std::size_t number, bool release_only) {
    return results::schedule_of(golden, release_only).jobs.at(number).job.timestamp - Time{};
  };
  EXPECT_EQ(timestamp(1, false), 12ms);
  EXPECT_EQ(timestamp(2, false), 32ms);
  EXPECT_EQ(timestamp(1, true), 12ms);
  EXPECT_EQ(timestamp(2, true), 22ms);
}

}  // namespace hotpath::schedule_test
