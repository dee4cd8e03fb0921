// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph.hpp"

#include <gmock/gmock.h>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath::find_chains_test {

using testing::ElementsAre;
using testing::SizeIs;

TEST(FindChains, TakesTheLongestOfAutowareFirst) {
  const Graph graph = load_graph(find_graph("autoware"));
  const std::vector<Chain> chains = find_chains(graph, make_tasks(graph), 3);
  ASSERT_THAT(chains, SizeIs(3));
  EXPECT_THAT(chains[0].nodes, ElementsAre("FrontLidarDriver", "PointsTransformerFront", "PointCloudFusion",
                                           "VoxelGridDownsampler", "NDTLocalizer", "Lanelet2GlobalPlanner",
                                           "Lanelet2MapLoader", "LanePlanner", "BehaviorPlanner",
                                           "MPCController", "VehicleInterface", "VehicleDBWSystem"));
  EXPECT_EQ(chains[0].sink, "VehicleDBWSystem");
}

TEST(FindChains, OfEquallyLongOnesTakesThatWithMostWork) {
  const Graph graph = load(
      "name: g\nnodes: [{name: S, type: sensor, period_ms: 10}, {name: A, type: command, input: S, "
      "execution_time_ms: 2}, {name: B, type: command, input: S, execution_time_ms: 1}]");
  EXPECT_THAT(find_chains(graph, make_tasks(graph), 1).front().nodes, ElementsAre("S", "A"));
}

TEST(FindChains, ReturnsValidChains) {
  for (const FileListing& listing : list_graphs()) {
    Graph graph = load_graph(listing.path);
    graph.chains = find_chains(graph, make_tasks(graph), 1000);
    EXPECT_NO_THROW((void)load(graph_yaml(graph))) << graph_yaml(graph);
  }
}

TEST(FindChains, NamesTasksOfNodesWithCallbacks) {
  const Graph graph = load_graph(find_graph("callbacks"));
  const std::vector<Chain> chains = find_chains(graph, make_tasks(graph), 1);
  ASSERT_THAT(chains, SizeIs(1));
  EXPECT_THAT(chains[0].nodes,
              ElementsAre("Driver/imu", "Localizer/imu", "Localizer/points", "Planner/pose", "Controller"));
}

TEST(FindChains, FindsNoneAmongTimersAlone) {
  const Graph graph = load_graph(find_graph("timers_only_60"));
  EXPECT_THAT(find_chains(graph, make_tasks(graph), 10), SizeIs(0));
}

}  // namespace hotpath::find_chains_test
