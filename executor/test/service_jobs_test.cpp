// SPDX-License-Identifier: Apache-2.0
// Jobs of services under an executor that is overloaded by a more urgent timer.
#include <gtest/gtest.h>

#include "hotpath/core/events_scheduler.hpp"
#include "task_sets.hpp"

namespace hotpath::test::service_jobs_test {

constexpr Duration kWait = 100ms;
constexpr Worker kExecutor = EventsScheduler::kExecutor;

struct Started {
  Duration arrival, start;
};

/// Jobs of a subscription that gets a sample every 70 ms, without a timer upstream, beside a timer
/// with 30 ms of work every 20 ms, in ten seconds.
std::vector<Started> started(const char* executor, const SchedulerOptions& options, bool service) {
  TaskSet set;
  const TaskId hog = add_timer(set, 20ms, 30ms);
  set.tasks[hog].priority = 1;
  const TaskId served = add_subscription(set, {}, 1ms, 256);
  set.tasks[served].service = service;
  const auto scheduler = find_executor(executor)->make(set, options);
  const auto timer_worker = static_cast<Worker>(scheduler->workers().size() - 1);
  scheduler->begin(Time{});
  std::vector<Started> jobs;
  Duration arrival{};
  for (Duration now{}; now < 10s;) {
    static_cast<void>(take_turn(*scheduler, timer_worker, at(now)));
    for (; arrival <= now; arrival += 70ms) {
      static_cast<void>(scheduler->sample_arrived(served, {at(arrival), kNever, {hog, 0}}, at(now)));
    }
    const std::optional<Job> job = take_turn(*scheduler, kExecutor, at(now)).decision.job;
    if (job && job->task == served) jobs.push_back({job->timestamp - Time{}, now});
    now += job ? set[job->task].wcet : Duration(1ms);
    if (job) static_cast<void>(scheduler->finished(kExecutor, *job, at(now)));
  }
  return jobs;
}

class ServiceWait : public testing::TestWithParam<const char*> {};

TEST_P(ServiceWait, WithoutOneTheyNeverRun) {
  SchedulerOptions options;
  options.service_wait = kWait;
  EXPECT_TRUE(started(GetParam(), options, false).empty());
  EXPECT_TRUE(started(GetParam(), {}, true).empty());
}

TEST_P(ServiceWait, TheOldestRunsAfterTheWaitAndTheShareIsBounded) {
  for (const unsigned workers : {1U, 2U}) {
    SchedulerOptions options;
    options.service_wait = kWait;
    options.release_only_workers = workers;
    const std::vector<Started> jobs = started(GetParam(), options, true);
    // One start needs the wait, then the end of the running job.
    EXPECT_GE(jobs.size(), static_cast<std::size_t>(10s / (kWait + 31ms)));
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      EXPECT_EQ(jobs[i].arrival, static_cast<std::int64_t>(i) * 70ms);
      EXPECT_GE(jobs[i].start - jobs[i].arrival, kWait);
      if (i == 0) {
        EXPECT_LE(jobs[i].start - jobs[i].arrival, kWait + 30ms);
      } else {
        EXPECT_GE(jobs[i].start - jobs[i - 1].start, kWait);
        EXPECT_LE(jobs[i].start - jobs[i - 1].start, kWait + 30ms);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Executors, ServiceWait, testing::Values("rm-ro", "dm-ro", "edf-ro", "fp-ro"),
                         [](const auto& test_case) { return std::string(test_case.param).substr(0, 2); });

/// The tasks that a decision shows to a recorded schedule's choice, which rejects all of them.
std::vector<TaskId> seen(Scheduler& scheduler, Duration now) {
  std::vector<TaskId> tasks;
  scheduler.follow([&](TaskId task) {
    tasks.push_back(task);
    return false;
  });
  EXPECT_EQ(take_turn(scheduler, kExecutor, at(now)).decision.job, std::nullopt);
  return tasks;
}

TEST(ServiceJobs, ADecisionThatFollowsARecordKnowsTheRule) {
  TaskSet set;
  add_timer(set, 1s, 1ms);
  const TaskId urgent = add_subscription(set, {0}, 1ms);
  const TaskId served = add_subscription(set, {}, 1ms);
  set.tasks[served].service = true;
  SchedulerOptions options;
  options.service_wait = kWait;
  const auto scheduler = find_executor("rm-ro")->make(set, options);
  scheduler->begin(Time{});
  static_cast<void>(scheduler->sample_arrived(served, {at(0ms), kNever, {0, 0}}, at(0ms)));
  static_cast<void>(scheduler->sample_arrived(urgent, {at(1ms), kNever, {0, 0}}, at(1ms)));
  EXPECT_EQ(seen(*scheduler, 99ms).front(), urgent);
  EXPECT_EQ(seen(*scheduler, 100ms).front(), served);
  scheduler->follow([&](TaskId task) { return task == urgent; });
  EXPECT_EQ(take_turn(*scheduler, kExecutor, at(100ms)).decision.job->task, urgent);
  EXPECT_EQ(seen(*scheduler, 100ms).front(), served);
  scheduler->remove_task(served, at(100ms), [](const Job&, Outcome) {});
  static_cast<void>(scheduler->sample_arrived(urgent, {at(101ms), kNever, {0, 1}}, at(101ms)));
  EXPECT_EQ(seen(*scheduler, 200ms), std::vector<TaskId>{urgent});
}

TEST(ServiceJobs, ARemovedTaskIsForgotten) {
  const auto all = [](TaskId) { return true; };
  ServiceJobs jobs(kWait);
  jobs.arrived(1, at(0ms));
  jobs.arrived(2, at(10ms));
  EXPECT_EQ(jobs.overdue(at(99ms), all), std::nullopt);
  EXPECT_EQ(jobs.next_change(at(99ms)), at(100ms));
  EXPECT_EQ(jobs.overdue(at(100ms), all), 1U);
  EXPECT_EQ(jobs.overdue(at(110ms), [](TaskId task) { return task == 2; }), 2U);
  jobs.removed(1);
  EXPECT_EQ(jobs.overdue(at(100ms), all), std::nullopt);
  EXPECT_EQ(jobs.overdue(at(110ms), all), 2U);
}

}  // namespace hotpath::test::service_jobs_test
