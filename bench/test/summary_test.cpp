// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace hotpath::summary_test {

using std::chrono::milliseconds;
using testing::_;
using testing::FieldsAre;

constexpr TaskId kLidar = 0, kPoints = 1, kClusters = 2, kPlanner = 3;
constexpr Time kEpoch = from_ns(5'000'000'000);

Time at(double ms) { return kEpoch + from_ms(ms); }

/// A LiDAR driver feeds both inputs of an estimator; a planner has only its timer.
TaskSet small_set() {
  TaskSet set;
  for (const std::string name : {"Lidar", "Estimator/points", "Estimator/clusters", "Planner"}) {
    Task& task = set.tasks.emplace_back();
    task.name = name;
    task.kind = name.starts_with("Estimator") ? TaskKind::subscription : TaskKind::timer;
    if (task.kind == TaskKind::timer) task.period = task.deadline = milliseconds(100);
  }
  set.tasks[kLidar].feeds = {kPoints, kClusters};
  return set;
}

JobRecord job(TaskId task, std::uint64_t sequence, double timestamp_ms, double start_ms, double finish_ms,
              Outcome outcome = Outcome::ran) {
  const Time timestamp = at(timestamp_ms);
  return {
      {task, sequence, timestamp, timestamp, kNever, {}}, at(start_ms), at(finish_ms), Duration(-1), outcome};
}

results::Repetition repetition(std::uint32_t number, std::vector<JobRecord> jobs,
                               std::vector<ChainRecord> chains = {}) {
  results::Repetition r;
  r.trace.executor = "default";
  r.trace.repetition = number;
  r.trace.epoch = kEpoch;
  r.trace.end = at(500);
  r.trace.jobs = std::move(jobs);
  r.trace.chains = std::move(chains);
  return r;
}

ChainRecord output(std::uint64_t sequence, double hot_path_ms, double end_to_end_ms = -1e-6) {
  return {0, sequence, 0, from_ms(hot_path_ms), from_ms(end_to_end_ms), kPoints};
}

results::SummaryOptions options(double warm_up_ms = 0) {
  results::SummaryOptions o;
  o.chains = {"hot_path"};
  o.warm_up = from_ms(warm_up_ms);
  o.bootstrap.resamples = 200;
  return o;
}

results::ExecutorSummary summary_of(std::vector<results::Repetition> repetitions,
                                    const results::SummaryOptions& o = options()) {
  return results::summarize(small_set(), {{"default", std::move(repetitions)}}, o).executors.at(0);
}

results::ExecutorSummary summary_of_jobs(std::vector<JobRecord> jobs, double warm_up_ms = 0) {
  return summary_of({repetition(0, std::move(jobs))}, options(warm_up_ms));
}

TEST(WarmUp, LeavesOutTheOutputsWhoseOwnSinkJobWasPublishedBeforeIt) {
  results::Repetition r = repetition(
      0, {job(kPoints, 0, 99.9, 120, 121), job(kPoints, 3, 100, 160, 161), job(kClusters, 3, 50, 60, 61)},
      {output(0, 10), output(3, 10)});
  const auto counted = results::counted_chains(r.trace, at(100));
  ASSERT_EQ(counted.size(), 1u);
  EXPECT_EQ(counted[0].sequence, 3u);
  r.trace.chains[1].sink = kClusters;  // whose job has the same sequence
  EXPECT_TRUE(results::counted_chains(r.trace, at(100)).empty());
  EXPECT_EQ(results::counted_chains(r.trace, at(50)).size(), 2u);
}

TEST(WarmUp, IsLeftOutOfResponseTimesPeriodsAndOverruns) {
  const results::ExecutorSummary s = summary_of_jobs(
      {job(kPlanner, 0, 0, 150, 190), job(kPlanner, 1, 100, 200, 230), job(kPlanner, 2, 200, 310, 320)}, 100);
  const results::TaskSummary& planner = s.tasks.at(kPlanner);
  EXPECT_EQ(planner.response_ms.n, 2u);
  EXPECT_DOUBLE_EQ(planner.response_ms.max, 130);
  EXPECT_DOUBLE_EQ(planner.response_ms.min, 120);
  EXPECT_EQ(planner.after_warm_up.deadline_overruns, 2u);
  EXPECT_EQ(planner.period_ms.n, 1u);
}

TEST(WarmUp, TimestampsAfterItThatACallInItSkippedCount) {
  JobRecord skipping = job(kPlanner, 0, 0, 250, 260);
  skipping.job.skipped = 2;  // 100 and 200
  const results::TaskSummary planner = summary_of_jobs({skipping}, 200).tasks.at(kPlanner);
  EXPECT_THAT(planner.after_warm_up, FieldsAre(1u, 0u, 1u, _));
}

TEST(Waits, LastFromTheTimestampToTheStartOrToTheEndOfTheRun) {
  const results::Repetition first = repetition(
      0, {job(kPlanner, 0, 0, 30, 90), job(kPoints, 0, 10, 15, 16),
          job(kClusters, 0, 10, 0, 0, Outcome::overwritten), job(kLidar, 0, 0, 2, 0, Outcome::running)});
  const results::Repetition second = repetition(
      1, {job(kPlanner, 0, 420, 0, 0, Outcome::queued), job(kPoints, 0, 10, 400, 400, Outcome::empty)});
  const results::ExecutorSummary s = summary_of({first, second});
  EXPECT_EQ(s.tasks[kPlanner].longest_wait, milliseconds(80));
  EXPECT_EQ(s.tasks[kPoints].longest_wait, milliseconds(5));
  EXPECT_EQ(s.tasks[kClusters].longest_wait, milliseconds(0)) << "never taken";
  EXPECT_EQ(s.tasks[kLidar].longest_wait, milliseconds(2));
  EXPECT_EQ(s.each[0].deadline_overruns, 1u) << "Lidar runs until the end";
  EXPECT_EQ(s.each[1].deadline_overruns, 0u);
}

TEST(Waits, CountFromTheEndOfTheWarmUpOn) {
  const results::ExecutorSummary s =
      summary_of_jobs({job(kLidar, 0, 0, 99, 100), job(kPlanner, 0, 20, 130, 140),
                       job(kPoints, 0, 50, 0, 0, Outcome::queued)},
                      100);
  EXPECT_EQ(s.tasks[kLidar].longest_wait, milliseconds(0));
  EXPECT_EQ(s.tasks[kPlanner].longest_wait, milliseconds(30));
  EXPECT_EQ(s.tasks[kPoints].longest_wait, milliseconds(400)) << "it starves since the warm-up";
}

TEST(Waits, ATaskNeverRanWhenItHadWorkAndNoJobOfItStarted) {
  results::Repetition r =
      repetition(0, {job(kLidar, 0, 0, 1, 2), job(kPoints, 0, 2, 0, 0, Outcome::overwritten),
                     job(kClusters, 0, 2, 3, 0, Outcome::running)});
  r.expected = expected_jobs(small_set(), r.trace);
  const results::ExecutorSummary s = summary_of({r});
  EXPECT_TRUE(s.tasks[kPoints].never_ran());
  EXPECT_FALSE(s.tasks[kLidar].never_ran());
  EXPECT_FALSE(s.tasks[kClusters].never_ran());
  EXPECT_FALSE(s.tasks[kPlanner].never_ran()) << "it had nothing to do";
}

TEST(Latencies, BothOfDesignAreTakenPerChain) {
  const results::ExecutorSummary s =
      summary_of({repetition(0, {}, {output(0, 20, 25), output(1, 30), output(2, 40, 45)})});
  ASSERT_EQ(s.chains.size(), 1u);
  EXPECT_EQ(s.chains[0].chain, "hot_path");
  EXPECT_EQ(s.chains[0].hot_path.quantiles.n, 3u);
  EXPECT_DOUBLE_EQ(s.chains[0].hot_path.quantiles.p50, 30);
  EXPECT_EQ(s.chains[0].end_to_end.quantiles.n, 2u) << "an unknown end-to-end latency is no sample";
  EXPECT_DOUBLE_EQ(s.chains[0].end_to_end.quantiles.p50, 35);
  EXPECT_FALSE(s.chains[0].hot_path.estimate(&Quantiles::p50).interval) << "one repetition has no interval";
  const results::ExecutorSummary two =
      summary_of({repetition(0, {}, {output(0, 20)}), repetition(1, {}, {output(0, 30)})});
  EXPECT_DOUBLE_EQ(two.chains[0].hot_path.low.max, 20);
  EXPECT_DOUBLE_EQ(two.chains[0].hot_path.high.max, 30);
  EXPECT_FALSE(two.chains[0].end_to_end.estimate(&Quantiles::p50).interval);
}

TEST(Outputs, HaveIntervalsWithinARepetitionAndASpreadOfTheirSources) {
  const auto outputs = [](const std::vector<double>& finishes_ms) {
    std::vector<ChainRecord> all;
    for (const double ms : finishes_ms) {
      ChainRecord& r = all.emplace_back(output(all.size(), 1));
      r.finish = at(ms);
      r.disparity = from_ms(ms / 10);
    }
    return all;
  };
  const results::ExecutorSummary s =
      summary_of({repetition(0, {}, outputs({130, 100, 250})), repetition(1, {}, outputs({1000, 1010}))});
  EXPECT_EQ(s.chains[0].interval_ms.n, 3U);
  EXPECT_DOUBLE_EQ(s.chains[0].interval_ms.max, 120);
  EXPECT_DOUBLE_EQ(s.chains[0].interval_ms.min, 10);
  EXPECT_DOUBLE_EQ(s.chains[0].disparity_ms.max, 101);
}

TEST(Latencies, HotPathDropsAreThoseOfTheCountedOutputs) {
  ChainRecord early = output(0, 1), late = output(1, 1);
  early.dropped = 5;
  late.dropped = 2;
  results::Repetition r =
      repetition(0, {job(kPoints, 0, 0, 1, 2), job(kPoints, 1, 100, 101, 102)}, {early, late});
  EXPECT_EQ(summary_of({r}).chains[0].drops, 7u);
  r.trace.chains = results::counted_chains(r.trace, at(100));
  EXPECT_EQ(summary_of({r}, options(100)).chains[0].drops, 2u);
}

TEST(Ratio, IsThatOfThisExecutorToDefault) {
  const std::vector<results::ExecutorRuns> runs = {
      {"rm-ro", {repetition(0, {}, {output(0, 10), output(1, 12), output(2, 20)})}},
      {"default", {repetition(0, {}, {output(0, 20), output(1, 24), output(2, 50)})}}};
  const results::Summary s = results::summarize(small_set(), runs, options());
  EXPECT_DOUBLE_EQ(s.executors[0].chains[0].hot_path.to_default[results::kMedian]->value, 0.5);
  EXPECT_DOUBLE_EQ(s.executors[0].chains[0].hot_path.to_default[results::kWorst]->value, 0.4);
  EXPECT_DOUBLE_EQ(s.executors[0].chains[0].hot_path.median_minus_default->value, -12);
  EXPECT_EQ(s.executors[1].chains[0].hot_path.to_default[results::kMedian]->value, 1.0);
  EXPECT_EQ(s.executors[1].chains[0].hot_path.median_minus_default->value, 0.0);
  EXPECT_FALSE(s.executors[0].chains[0].end_to_end.to_default[results::kMedian]) << "no age is known";
}

TEST(Ratio, OnAnotherStackIsThatToItsDefault) {
  const auto measured = [](double ms) {
    return std::vector<results::Repetition>{repetition(0, {}, {output(0, ms)})};
  };
  const results::Summary s = results::summarize(small_set(),
                                                {{"default", measured(20)},
                                                 {"rm-ro@rclcpp", measured(10)},
                                                 {"default@rclcpp", measured(40)},
                                                 {"rm-ro@other", measured(10)}},
                                                options());
  EXPECT_DOUBLE_EQ(s.executors[1].chains[0].hot_path.to_default[results::kMedian]->value, 0.25);
  EXPECT_EQ(s.executors[2].chains[0].hot_path.to_default[results::kMedian]->value, 1.0);
  EXPECT_FALSE(s.executors[3].chains[0].hot_path.to_default[results::kMedian]);
  EXPECT_TRUE(nlohmann::json(s)["executors"][3]["chains"][0]["ratio_to_default"]["max"].is_null());
}

TEST(Counts, FollowTheAccountsOfAllRepetitionsWithTheWarmUp) {
  std::vector<results::Repetition> repetitions;
  for (std::uint32_t number = 0; number < 2; ++number) {
    JobRecord skipping = job(kPlanner, 0, 0, 250, 260);
    skipping.job.skipped = 2;  // 100 and 200
    results::Repetition r = repetition(
        number, {skipping, job(kPlanner, 3, 300, 300, 310), job(kPlanner, 4, 400, 0, 0, Outcome::queued),
                 job(kPoints, 1, 200, 270, 271), job(kPoints, 0, 100, 0, 0, Outcome::overwritten)});
    r.trace.published = {0, 2, 2, 0};
    r.expected = expected_jobs(small_set(), r.trace);
    repetitions.push_back(std::move(r));
  }
  const results::ExecutorSummary s = summary_of(std::move(repetitions), options(450));
  EXPECT_EQ(s.executed, 6u);
  EXPECT_EQ(s.skipped, 4u);
  EXPECT_EQ(s.overwritten, 2u);
  ASSERT_EQ(s.each.size(), 2u);
  EXPECT_EQ(s.each[1].repetition, 1u);
  EXPECT_THAT(static_cast<const results::Losses&>(s.each[1]), FieldsAre(2u, 1u));
  EXPECT_EQ(s.tasks[kPlanner].account[Outcome::skipped], 4u);
  EXPECT_EQ(s.tasks[kPlanner].account[Outcome::queued], 2u);
  EXPECT_EQ(s.tasks[kPoints].account[Outcome::overwritten], 2u);
  EXPECT_EQ(s.tasks[kPlanner].response_ms.n, 0u);
  // No row accounts for the LiDAR's five timestamps and the two samples of Estimator/clusters.
  ASSERT_EQ(s.unbalanced.size(), 4u);
  EXPECT_THAT(s.unbalanced[0], FieldsAre(0u, "Lidar", 0u, 5u));
  EXPECT_THAT(s.unbalanced[3], FieldsAre(1u, "Estimator/clusters", 0u, 2u));
}

TEST(AuthorsResponse, RefersToTheLatestReleaseBeforeTheStart) {
  TaskSet set;
  Task& timer = set.tasks.emplace_back();
  timer.name = "IMU";
  timer.period = timer.deadline = milliseconds(30);
  // Both timestamps are released on time; the second job already waits when the first starts.
  const JobRecord first = job(0, 0, 0, 40, 45), second = job(0, 1, 30, 45, 50);
  const auto of = [](const TaskSet& tasks, const std::vector<JobRecord>& jobs) {
    return results::summarize(tasks, {{"rm-ro", {repetition(0, jobs)}}}, {}).executors.at(0).tasks.at(0);
  };
  const results::TaskSummary task = of(set, {first, second});
  EXPECT_DOUBLE_EQ(task.response_ms.max, 45);
  EXPECT_DOUBLE_EQ(task.response_authors_ms.min, 15);
  EXPECT_DOUBLE_EQ(task.response_authors_ms.max, 20);
  // A release at the very start of a job precedes it; a skipped timestamp moves the next call.
  JobRecord late = job(0, 0, 0, 30, 35);
  EXPECT_DOUBLE_EQ(of(set, {late, second}).response_authors_ms.min, 5);
  late.job.skipped = 2;
  EXPECT_DOUBLE_EQ(of(set, {late}).response_authors_ms.max, -25);
  set.tasks.emplace_back().kind = TaskKind::subscription;
  EXPECT_EQ(of(set, {first, second}).response_authors_ms.n, 0u) << "not timers alone";
}

TEST(Usage, CpuTimePerExecutedCallbackOverAllRepetitions) {
  std::vector<results::Repetition> repetitions;
  for (std::uint32_t number = 0; number < 2; ++number) {
    results::Repetition r =
        repetition(number, {job(kLidar, 0, 0, 1, 2), job(kPlanner, 0, 0, 2, 3)}, {output(0, 1)});
    r.usage.cpu_time = std::chrono::microseconds(60 + 40 * number);
    r.usage.peak_memory_kib = 2000 - number;
    r.usage.involuntary_switches = 3;
    r.usage.wall = milliseconds(1);
    r.expected = expected_jobs(small_set(), r.trace);
    repetitions.push_back(std::move(r));
  }
  const results::ExecutorSummary s = summary_of(std::move(repetitions));
  EXPECT_DOUBLE_EQ(s.cpu_per_callback_us, 160.0 / 4.0);
  EXPECT_EQ(s.usage.peak_memory_kib, 2000);
  EXPECT_EQ(s.usage.involuntary_switches, 6);
}

TEST(Usage, OfAnotherProcessForLessThanThreeTicksIsNoDisturbance) {
  results::ProcessUsage usage;
  usage.wall = milliseconds(100);
  usage.others = milliseconds(29);
  EXPECT_TRUE(results::disturbances(usage).empty());
  usage.others = milliseconds(30);
  EXPECT_EQ(results::disturbances(usage).size(), 1u);
}

TEST(SummaryJson, IsValidWithoutAnySample) {
  const auto j = nlohmann::json::parse(
      nlohmann::json(results::summarize(small_set(), {{"default", {}}}, options())).dump());
  const auto& executor = j.at("executors").at(0);
  EXPECT_EQ(executor.at("callbacks_executed"), 0);
  EXPECT_TRUE(executor.at("cpu_per_callback_us").is_null());
  EXPECT_TRUE(executor.at("usage").at("cpu_use_percent").is_null());
  EXPECT_EQ(executor.at("chains").at(0).at("hot_path_latency_ms").at("n"), 0);
  EXPECT_TRUE(executor.at("chains").at(0).at("hot_path_latency_ms").at("p999").is_null());
}

TEST(SummaryJson, NamesUnitsInItsKeys) {
  results::Repetition r = repetition(0, {job(kLidar, 0, 0, 1, 2)}, {output(0, 21.5, 30)});
  r.expected = expected_jobs(small_set(), r.trace);
  r.usage.cpu_time = milliseconds(250);
  r.usage.wall = milliseconds(500);
  r.usage.others = milliseconds(50);
  results::Repetition second = r;
  second.trace.repetition = 1;
  const nlohmann::json j = results::summarize(small_set(), {{"default", {r, second}}}, options(0));
  const auto& executor = j.at("executors").at(0);
  EXPECT_EQ(executor.at("usage").at("cpu_use_percent"), 50.0);
  EXPECT_EQ(executor.at("cpu_per_callback_us"), 250000.0);
  EXPECT_EQ(executor.at("disturbed").at(0).at("marks").at(0), "10.0 % of the time used by other processes");
  const auto& chain = executor.at("chains").at(0);
  EXPECT_EQ(chain.at("hot_path_latency_ms").at("max"), 21.5);
  EXPECT_EQ(chain.at("hot_path_latency_ms").at("interval").dump(),
            R"({"max":[21.5,21.5],"p50":[21.5,21.5],"p99":[21.5,21.5],"p999":[21.5,21.5]})");
  EXPECT_EQ(chain.at("end_to_end_latency_ms").at("p50"), 30.0);
  EXPECT_EQ(chain.at("ratio_to_default").at("max").at("value"), 1.0);
  EXPECT_EQ(chain.at("difference_to_default_ms").at("median").at("value"), 0.0);
  EXPECT_FALSE(executor.at("loss_equations").at("hold"));
  EXPECT_EQ(executor.at("tasks").at(kLidar).at("response_ms").at("p50"), 2.0);
}

}  // namespace hotpath::summary_test
