// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_picture.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/reference_node.hpp"

namespace hotpath {
namespace {

/// With tasks and a deployment, or neither.
std::vector<std::string> lines_of(const Graph& graph, const auto&... deployed) {
  std::stringstream dot;
  write_dot(dot, graph, deployed...);
  std::vector<std::string> lines;
  for (std::string line; std::getline(dot, line);) lines.push_back(line);
  return lines;
}

/// The line that begins with `start`; empty if there is none.
std::string line(const std::vector<std::string>& lines, const std::string& start) {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.starts_with("  " + start); });
  return found == lines.end() ? "" : *found;
}

const std::string kHot = "#c62828";

TEST(Picture, DrawsEveryNodeAndSubscriptionAndMarksTheHotPathAlone) {
  const auto lines = lines_of(load_graph(find_graph("autoware")));
  std::size_t nodes = 0, edges = 0, hot_nodes = 0, hot_edges = 0;
  for (const std::string& l : lines) {
    const bool hot = l.find(kHot) != std::string::npos, edge = l.find("->") != std::string::npos;
    nodes += l.find("shape=") != std::string::npos;
    edges += edge;
    hot_nodes += hot && !edge;
    hot_edges += hot && edge;
  }
  EXPECT_EQ(nodes, 24U);
  EXPECT_EQ(edges, 29U);
  EXPECT_EQ(hot_nodes, 8U);
  EXPECT_EQ(hot_edges, 7U);
  EXPECT_THAT(line(lines, "\"PointCloudFusion\" -> \"RayGroundFilter\""), testing::HasSubstr(kHot));
  EXPECT_THAT(line(lines, "\"PointCloudFusion\" -> \"VoxelGridDownsampler\""),
              testing::AllOf(testing::Not(testing::IsEmpty()), testing::Not(testing::HasSubstr(kHot))));
}

TEST(Picture, LabelsTimersWithTheirPeriodWorkWithItsTimeAndTopicsOfAnotherName) {
  const auto lines = lines_of(load_graph(find_graph("autoware")));
  EXPECT_THAT(line(lines, "\"EuclideanClusterSettings\" ["), testing::HasSubstr("every 25 ms"));
  EXPECT_THAT(line(lines, "\"RayGroundFilter\" ["), testing::HasSubstr("works 4.2 ms"));
  EXPECT_THAT(line(lines, "\"EuclideanClusterDetector\" -> \"IntersectionOutput\""),
              testing::HasSubstr("EuclideanIntersection"));
  EXPECT_THAT(line(lines, "\"FrontLidarDriver\" ->"), testing::Not(testing::HasSubstr("label")));
}

TEST(Picture, ColoursNodesByExecutorWithALegend) {
  const Graph graph = load_graph(find_graph("autoware"));
  const GraphTasks tasks = make_tasks(graph);
  const auto lines = lines_of(graph, tasks, find_deployment("picas", graph, tasks));
  const auto fill = [&](const std::string& node) {
    const std::string l = line(lines, "\"" + node + "\" [");
    const std::size_t begin = l.find("fillcolor=");
    return l.substr(begin, l.find(',', begin) - begin);
  };
  EXPECT_EQ(fill("FrontLidarDriver"), fill("PointCloudFusion"));
  EXPECT_EQ(fill("RearLidarDriver"), fill("PointsTransformerRear"));
  EXPECT_NE(fill("FrontLidarDriver"), fill("RearLidarDriver"));
  EXPECT_NE(fill("Visualizer"), fill("RearLidarDriver"));
  EXPECT_THAT(line(lines, "  \"deployment/picas\""),
              testing::AllOf(testing::HasSubstr("<b>hot_path</b>: fp-ro, fifo:88, on processors 0<"),
                             testing::HasSubstr("<b>rest</b>: fp-ro, fifo:80")));
}

TEST(Picture, TheFirstCallbackColoursANodeOfSeveralExecutors) {
  const Graph graph = load_graph(find_graph("callbacks"));
  const GraphTasks tasks = make_tasks(graph);
  Deployment deployment = find_deployment("rm-threads", graph, tasks);
  const auto driver = [&] { return line(lines_of(graph, tasks, deployment), "\"Driver\" ["); };
  const std::string before = driver();
  deployment.executor_of[1] = 5;
  EXPECT_EQ(driver(), before);
  deployment.executor_of[0] = 5;
  EXPECT_NE(driver(), before);
}

TEST(Picture, EscapesWhatGraphvizWouldRead) {
  Graph graph;
  graph.name = "g";
  ReferenceNode node;
  node.name = "a<b>&\\";
  node.outputs = {node.name};
  graph.nodes = {node};
  EXPECT_THAT(line(lines_of(graph), "\"a<b>&\\\\\" ["), testing::HasSubstr("a&lt;b&gt;&amp;\\"));
}

}  // namespace
}  // namespace hotpath
