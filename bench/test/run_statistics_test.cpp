// SPDX-License-Identifier: Apache-2.0
#include "telemetry/run_statistics.hpp"

#include <gmock/gmock.h>

#include "reference_nodes.hpp"

namespace hotpath::run_statistics_test {

using std::chrono::milliseconds;

constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;
constexpr auto none = [](TaskId) { return 0U; };

/// Tasks: 0 Lidar, 1 Planner/Lidar, 2 Planner (its timer), 3 Logger/Planner.
Graph small_graph() {
  Graph g;
  g.name = "small";
  g.nodes = {reference_node("Lidar", NodeType::sensor, {}, milliseconds(20)),
             reference_node("Planner", NodeType::cyclic, {{"Lidar", 1, {}}}, milliseconds(20)),
             reference_node("Logger", NodeType::command, {{"Planner", 10, {}}})};
  g.chains = {{"path", {"Lidar", "Planner"}, {"Lidar"}, "Planner"}};
  return g;
}

Time at(std::int64_t ms) { return Time{} + milliseconds(ms); }

JobRecord ran(TaskId task, std::int64_t timestamp_ms, std::int64_t start_ms, std::int64_t finish_ms) {
  return {{task, 0, at(timestamp_ms), {}, kNever, {}}, at(start_ms), at(finish_ms)};
}

class RunStatisticsTest : public ::testing::Test {
 protected:
  RunStatisticsTest() : tasks(make_tasks(graph)) { tasks.set.tasks[2].phase = milliseconds(5); }
  telemetry::RunStatistics make(Duration warm_up = {}) {
    telemetry::RunInfo info;
    info.run_id("id");
    info.epoch_ns(kEpochNs);
    return {graph, tasks, info, Time{}, warm_up};
  }

  const Graph graph = small_graph();
  GraphTasks tasks;
};

TEST_F(RunStatisticsTest, NothingIsKnownAtTheEpoch) {
  const telemetry::Statistics s = make().take(Time{}, none);
  EXPECT_EQ(s.run_id(), "id");
  EXPECT_EQ(s.number(), 0U);
  EXPECT_FALSE(s.last());
  EXPECT_EQ(s.stamp_ns(), kEpochNs);
  ASSERT_EQ(s.nodes().size(), 3U);
  ASSERT_EQ(s.chains().size(), 1U);
  for (const telemetry::NodeStatistics& n : s.nodes()) {
    EXPECT_EQ(n.ran() + n.skipped() + n.overwritten() + n.overruns() + n.queued(), 0U);
    EXPECT_EQ(n.utilization(), 0);
    for (const std::int64_t ns :
         {n.response_window_ns(), n.response_median_ns(), n.response_p99_ns(), n.response_max_ns()})
      EXPECT_EQ(ns, -1);
  }
  EXPECT_EQ(s.chains()[0].samples(), 0U);
  EXPECT_EQ(s.chains()[0].latency_median_ns(), -1);
}

TEST_F(RunStatisticsTest, CountsJobsByTheNodeOfTheirTask) {
  telemetry::RunStatistics statistics = make();
  statistics.add(ran(0, 0, 1, 3));
  JobRecord late = ran(0, 20, 30, 61);
  late.job.deadline = at(40);
  late.job.skipped = 1;
  statistics.add(late);
  JobRecord overwritten;
  overwritten.job.task = 1;
  overwritten.outcome = Outcome::overwritten;
  statistics.add(overwritten);
  const telemetry::Statistics s = statistics.take(at(70), none);
  EXPECT_EQ(s.nodes()[0].ran(), 2U);
  EXPECT_EQ(s.nodes()[0].skipped(), 1U);
  EXPECT_EQ(s.nodes()[0].overruns(), 1U);
  EXPECT_EQ(s.nodes()[1].overwritten(), 1U);
  EXPECT_EQ(s.nodes()[1].ran(), 0U);
  EXPECT_EQ(s.nodes()[0].response_max_ns(), 41'000'000);
  EXPECT_NEAR(s.run_time_s(), 0.07, 1e-9);
  EXPECT_EQ(s.stamp_ns(), kEpochNs + 70'000'000);
}

TEST_F(RunStatisticsTest, WhatWasReachedOrPublishedAndHasNotEndedIsQueued) {
  telemetry::RunStatistics statistics = make();
  const auto published = [](TaskId id) { return id == 3 ? 2U : 0U; };
  // Lidar: 0, 20; Planner's timer: 5, 25; an instant is reached when it has passed.
  telemetry::Statistics s = statistics.take(at(40), published);
  EXPECT_EQ(s.nodes()[0].queued(), 2U);
  EXPECT_EQ(s.nodes()[1].queued(), 2U);
  EXPECT_EQ(s.nodes()[2].queued(), 2U);
  JobRecord lidar = ran(0, 0, 1, 3);
  lidar.job.skipped = 1;
  statistics.add(lidar);
  statistics.add(ran(2, 5, 6, 7));
  JobRecord empty = ran(3, 6, 7, 7);
  empty.outcome = Outcome::empty;
  statistics.add(empty);
  s = statistics.take(at(41), published);
  EXPECT_EQ(s.nodes()[0].queued(), 1U) << "the timestamp at 40 ms";
  EXPECT_EQ(s.nodes()[1].queued(), 1U);
  EXPECT_EQ(s.nodes()[2].queued(), 2U) << "an event without a sample is none";
}

TEST_F(RunStatisticsTest, AWindowHoldsWhatFinishedSinceTheLastStatistics) {
  telemetry::RunStatistics statistics = make();
  statistics.add(ran(0, 0, 1, 3));
  statistics.add(ran(0, 20, 20, 26));
  telemetry::Statistics s = statistics.take(at(40), none);
  EXPECT_DOUBLE_EQ(s.nodes()[0].utilization(), 8.0 / 40);
  EXPECT_EQ(s.nodes()[0].response_window_ns(), 4'500'000);
  s = statistics.take(at(50), none);
  EXPECT_EQ(s.number(), 1U);
  EXPECT_EQ(s.nodes()[0].utilization(), 0);
  EXPECT_EQ(s.nodes()[0].response_window_ns(), -1);
  EXPECT_EQ(s.nodes()[0].ran(), 2U);
  statistics.add(ran(0, 40, 50, 52));
  statistics.begin_window(at(55));
  EXPECT_EQ(statistics.take(at(60), none).nodes()[0].utilization(), 0);
}

TEST_F(RunStatisticsTest, JobsOfTheWarmUpAndJobsThatOnlyStoreASampleCountButDoNotRespond) {
  telemetry::RunStatistics statistics = make(milliseconds(30));
  statistics.add(ran(0, 20, 20, 39));
  statistics.add(ran(1, 30, 31, 39));  // the cyclic node's timer responds
  for (const telemetry::NodeStatistics& n : statistics.take(at(40), none).nodes())
    EXPECT_EQ(n.response_max_ns(), -1);
  statistics.add(ran(0, 40, 40, 42));
  statistics.add(ran(2, 45, 45, 47));
  const telemetry::Statistics s = statistics.take(at(50), none);
  for (const std::size_t node : {0, 1}) {
    EXPECT_EQ(s.nodes()[node].ran(), 2U);
    EXPECT_EQ(s.nodes()[node].response_max_ns(), 2'000'000);
  }
}

TEST(RunInfo, NamesNodesEdgesAndChainsOfTheGraph) {
  const telemetry::RunInfo info = telemetry::make_run_info(small_graph(), {}, "rm-ro", 0, 0);
  EXPECT_EQ(info.graph(), "small");
  ASSERT_EQ(info.nodes().size(), 3U);
  EXPECT_EQ(info.nodes()[1].name(), "Planner");
  EXPECT_EQ(info.nodes()[1].type(), "cyclic");
  EXPECT_TRUE(info.nodes()[1].hot());
  EXPECT_FALSE(info.nodes()[2].hot());
  EXPECT_EQ(info.nodes()[0].deadline_ns(), 20'000'000);
  EXPECT_EQ(info.nodes()[2].deadline_ns(), 0);
  EXPECT_EQ(info.nodes()[2].layout_x(), 2);
  ASSERT_EQ(info.edges().size(), 2U);
  EXPECT_TRUE(info.edges()[0].hot());
  EXPECT_EQ(info.edges()[1].source(), 1U);
  EXPECT_EQ(info.edges()[1].target(), 2U);
  EXPECT_EQ(info.edges()[1].topic(), "Planner");
  EXPECT_FALSE(info.edges()[1].hot());
  ASSERT_EQ(info.chains().size(), 1U);
  EXPECT_EQ(info.chains()[0].name(), "path");
  EXPECT_EQ(info.chains()[0].sink(), 1U);
}

}  // namespace hotpath::run_statistics_test
