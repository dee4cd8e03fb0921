// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_layout.hpp"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath::graph_layout_test {

ReferenceNode node(const std::string& name, const std::vector<std::string>& inputs) {
  ReferenceNode n;
  n.name = name;
  for (const std::string& topic : inputs) n.inputs.push_back({topic, 1, {}});
  n.outputs = {name};
  return n;
}

/// By node.
std::vector<double> columns_of(const Graph& graph) {
  std::vector<double> columns;
  for (const GraphPosition& p : graph_layout(graph)) columns.push_back(p.column);
  return columns;
}

/// One row per node, in creation order within each column: the initial layout.
std::vector<GraphPosition> in_creation_order(std::vector<GraphPosition> positions) {
  std::map<double, double> next;
  for (GraphPosition& p : positions) p.row = next[p.column]++;
  return positions;
}

TEST(Layout, NoTwoNodesOfAnyGraphShareAPlaceAndEdgesGoFromLeftToRight) {
  for (const std::string name : {"autoware", "sequences", "many_to_many", "timers_only_90"}) {
    SCOPED_TRACE(name);
    const Graph graph = load_graph(find_graph(name));
    const std::vector<GraphPosition> positions = graph_layout(graph);
    ASSERT_EQ(positions.size(), graph.nodes.size());
    std::set<std::pair<double, double>> places;
    for (const GraphPosition& p : positions) places.emplace(p.column, p.row);
    EXPECT_EQ(places.size(), positions.size());
    const std::vector<GraphEdge> edges = graph_edges(graph);
    for (const GraphEdge& e : edges)
      EXPECT_LT(positions[e.source].column, positions[e.target].column) << e.topic;
    EXPECT_LE(crossings(edges, positions), crossings(edges, in_creation_order(positions)));
  }
}

TEST(Layout, SourcesStandInTheFirstColumnAndASinkBehindItsLongestWay) {
  Graph graph;
  graph.nodes = {node("A", {}), node("B", {"A"}), node("C", {"A", "B"}), node("D", {})};
  EXPECT_THAT(columns_of(graph), testing::ElementsAre(0, 1, 2, 0));
}

TEST(Layout, UntanglesEdgesThatCrossInCreationOrder) {
  Graph graph;
  graph.nodes = {node("A", {}), node("B", {}), node("C", {"B"}), node("D", {"A"})};
  const std::vector<GraphEdge> edges = graph_edges(graph);
  EXPECT_EQ(crossings(edges, in_creation_order(graph_layout(graph))), 1U);
  EXPECT_EQ(crossings(edges, graph_layout(graph)), 0U);
}

TEST(Layout, ANodeOnAnEdgeOfOthersCountsAsACrossing) {
  const std::vector<GraphEdge> edges = {{0, 2, "long", false}};
  EXPECT_EQ(crossings(edges, {{0, 0}, {1, 0}, {2, 0}}), 1U);
  EXPECT_EQ(crossings(edges, {{0, 0}, {1, 1}, {2, 0}}), 0U);
}

TEST(Layout, EndsForAGraphWithACycle) {
  Graph graph;
  graph.nodes = {node("A", {"C"}), node("B", {"A"}), node("C", {"B"})};
  EXPECT_THAT(columns_of(graph), testing::UnorderedElementsAre(0, 1, 2));
}

}  // namespace hotpath::graph_layout_test
