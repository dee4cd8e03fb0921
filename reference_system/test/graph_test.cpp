// SPDX-License-Identifier: Apache-2.0
// Graphs as task sets. Compares Autoware with upstream's system builder and test_requirements.py,
// and the other graphs with the paper's and its authors' task sets.
#include "hotpath/reference_system/graph.hpp"

#include <gmock/gmock.h>

#include <map>
#include <stdexcept>
#include <tuple>

#include "graph_fixture.hpp"
#include "hotpath/core/paper_timers.hpp"
#include "hotpath/core/priority_order.hpp"

namespace hotpath::graph_test {

using testing::DoubleNear;
using testing::ElementsAre;

Graph graph_named(const std::string& name) { return load_graph(find_graph(name)); }

std::vector<std::string> names(const GraphTasks& tasks, const std::vector<TaskId>& ids) {
  std::vector<std::string> result;
  result.reserve(ids.size());
  for (const TaskId id : ids) result.push_back(tasks.set[id].name);
  return result;
}

class Autoware : public testing::Test {
 protected:
  TaskId task(const std::string& name) const { return task_named(tasks, name); }

  const Graph graph = graph_named("autoware");
  const GraphTasks tasks = make_tasks(graph);
};

TEST_F(Autoware, CreatesNodesInTheOrderOfUpstreamsSystemBuilder) {
  EXPECT_THAT(graph.node_names(),
              ElementsAre("FrontLidarDriver", "RearLidarDriver", "PointCloudMap", "Visualizer", "Lanelet2Map",
                          "EuclideanClusterSettings", "PointsTransformerFront", "PointsTransformerRear",
                          "VoxelGridDownsampler", "PointCloudMapLoader", "RayGroundFilter",
                          "ObjectCollisionEstimator", "MPCController", "ParkingPlanner", "LanePlanner",
                          "PointCloudFusion", "NDTLocalizer", "VehicleInterface", "Lanelet2GlobalPlanner",
                          "Lanelet2MapLoader", "BehaviorPlanner", "EuclideanClusterDetector",
                          "VehicleDBWSystem", "IntersectionOutput"));
}

TEST_F(Autoware, HasTheSubscriberCountsOfUpstreamsTestRequirements) {
  // The others have one or none.
  const std::map<std::string, int> several = {{"PointCloudFusion", 2},
                                              {"NDTLocalizer", 2},
                                              {"Lanelet2GlobalPlanner", 2},
                                              {"BehaviorPlanner", 2},
                                              {"Lanelet2MapLoader", 3}};
  std::map<std::string, int> publishers, subscribers;
  for (const Node& node : graph.nodes) {
    for (const std::string& topic : node.outputs) ++publishers[topic];
    for (const Input& input : node.inputs) ++subscribers[input.topic];
  }
  for (const auto& [topic, count] : publishers) EXPECT_EQ(count, 1) << topic;
  std::erase_if(subscribers, [](const auto& topic) { return topic.second == 1; });
  EXPECT_EQ(subscribers, several);
}

TEST_F(Autoware, FixedPrioritiesPutTheHotPathFirst) {
  const std::vector<std::int64_t> level = inherited_levels(tasks.set, Policy::fp);
  EXPECT_EQ(level[task("FrontLidarDriver")], 1);
  EXPECT_EQ(level[task("ObjectCollisionEstimator/EuclideanClusterDetector")], 1);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const std::string& name = tasks.set[id].name;
    if (tasks.set[id].kind != TaskKind::timer || name.find("LidarDriver") != std::string::npos) continue;
    EXPECT_GT(level[id], 2) << name;
  }
}

TEST_F(Autoware, Crunches190TimesASecondAndFillsOneCoreTo80Percent) {
  const std::vector<double> rates = activation_rates(tasks);
  double of_workers = 0;
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    if (tasks.set[id].wcet > Duration{}) of_workers += rates[id];
  EXPECT_THAT(of_workers, DoubleNear(190, 1e-9));
  EXPECT_THAT(load_percent(graph), DoubleNear(79.8, 1e-9));
  // A fusion fires with its slowest input: the 120 ms of PointCloudMap reach Lanelet2MapLoader
  // through two more fusions.
  EXPECT_THAT(rates[task("ParkingPlanner/Lanelet2MapLoader")], DoubleNear(1 / 0.12, 1e-9));
  EXPECT_THAT(rates[task("BehaviorPlanner/LanePlanner")], DoubleNear(1 / 0.12, 1e-9));
  EXPECT_THAT(rates[task("PointCloudFusion/PointsTransformerRear")], DoubleNear(5, 1e-9));
  EXPECT_THAT(rates[task("EuclideanClusterDetector/EuclideanClusterSettings")], DoubleNear(40, 1e-9));
}

TEST_F(Autoware, DeclaresUpstreamsHotPath) {
  ASSERT_EQ(graph.chains.size(), 1U);
  const Chain& chain = graph.chains.front();
  EXPECT_EQ(chain.name, "hot_path");
  EXPECT_THAT(chain.sources, ElementsAre("FrontLidarDriver", "RearLidarDriver"));
  EXPECT_EQ(chain.sink, "ObjectCollisionEstimator");
  EXPECT_THAT(chain.nodes, ElementsAre("FrontLidarDriver", "RearLidarDriver", "PointsTransformerFront",
                                       "PointsTransformerRear", "RayGroundFilter", "ObjectCollisionEstimator",
                                       "PointCloudFusion", "EuclideanClusterDetector"));
}

TEST(Load, OfZeroLeavesNoWorkAndIsNeverNegative) {
  Graph graph = graph_named("autoware");
  EXPECT_THROW(scale_to_load(graph, -1), std::invalid_argument);
  scale_to_load(graph, 0);
  EXPECT_EQ(load_percent(graph), 0);
  EXPECT_NO_THROW(scale_to_load(graph, 0));
  EXPECT_THROW(scale_to_load(graph, 80), std::invalid_argument);
}

// The sums of execution time over period in the paper's lists and in the authors' builders.
TEST(PaperTaskSets, HaveTheirUtilisation) {
  for (const auto& [graph, percent] : std::map<std::string, double>{{"timers_only_60", 61.0},
                                                                    {"timers_only_80", 80.0},
                                                                    {"timers_only_90", 89.5},
                                                                    {"timers_only_60_authors", 60.0},
                                                                    {"timers_only_80_authors", 79.1},
                                                                    {"timers_only_90_authors", 88.6},
                                                                    {"sequences", 58.2},
                                                                    {"sequences_high_utilisation", 95.0},
                                                                    {"many_to_many", 83.3}}) {
    EXPECT_THAT(load_percent(graph_named(graph)), DoubleNear(percent, 0.05)) << graph;
  }
}

/// S is read by A, B and C, and T by B and A; all nodes have both subscriptions but C.
Graph two_topics() {
  return load(R"(
name: g
nodes:
- {name: S, type: sensor, period_ms: 10}
- {name: T, type: sensor, period_ms: 10}
- {name: A, type: fusion, inputs: [S, T]}
- {name: B, type: fusion, inputs: [S, T]}
- {name: C, type: command, input: S}
)");
}

TEST(Rates, ScalePhasesAndKeepTheReleaseJitterBelowThePeriod) {
  Graph g;
  Callback& timer = g.nodes.emplace_back().callbacks.emplace_back();
  timer.period = std::chrono::milliseconds(100);
  timer.release_jitter = std::chrono::milliseconds(60);
  timer.phase = std::chrono::milliseconds(30);
  scale_rates(g, 200);
  EXPECT_EQ(timer.period, std::chrono::milliseconds(50));
  EXPECT_EQ(timer.release_jitter, timer.period - Duration(1));
  EXPECT_EQ(timer.phase, std::chrono::milliseconds(15));
}

TEST(Delivery, IsTheOrderOfCreationOfSubscriptions) {
  Graph g = two_topics();
  const auto created = [&] {
    const GraphTasks tasks = make_tasks(g);
    return names(tasks, tasks.subscriptions_to_create());
  };
  EXPECT_THAT(created(), ElementsAre("A/S", "A/T", "B/S", "B/T", "C/S"));
  g.delivery["S"].nodes = {"C", "A", "B"};
  EXPECT_THAT(created(), ElementsAre("C/S", "A/S", "A/T", "B/S", "B/T"));
  g.delivery["T"].nodes = {"B", "A"};  // against the order within the nodes
  EXPECT_THAT(created(), ElementsAre("C/S", "A/S", "B/S", "B/T", "A/T"));
}

TEST(Delivery, OfACopyIsThatOfTheGraph) {
  Graph g = two_topics();
  g.delivery["S"].nodes = {"C", "A", "B"};
  make_copies(g, 2);
  const GraphTasks tasks = make_tasks(g);
  EXPECT_THAT(names(tasks, tasks.set[task_named(tasks, "S_2")].feeds),
              ElementsAre("C_2/S_2", "A_2/S_2", "B_2/S_2"));
}

TEST(TimersOnlyGraphs, AreThePapersTaskSetsAsWrittenInTheLibrary) {
  const auto fields = [](const Task& t) {
    return std::tuple(t.name, t.kind, t.period, t.deadline, t.wcet, t.bcet, t.group);
  };
  for (const int utilisation : {60, 80, 90}) {
    const TaskSet in_file = make_tasks(graph_named("timers_only_" + std::to_string(utilisation))).set;
    const TaskSet in_library = paper_timers(utilisation);
    EXPECT_TRUE(std::ranges::equal(in_file.tasks, in_library.tasks, {}, fields, fields)) << utilisation;
    EXPECT_EQ(in_file.groups, in_library.groups);
  }
}

}  // namespace hotpath::graph_test
