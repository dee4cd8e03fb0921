// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_layout.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath::graph_picture_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::vector<std::string> lines_of(const Graph& graph, const Deployment* deployment = nullptr) {
  std::stringstream dot;
  write_dot(dot, graph, deployment);
  std::vector<std::string> lines;
  for (std::string line; std::getline(dot, line);) lines.push_back(line);
  return lines;
}

/// The line that begins with `start`; empty if there is none.
std::string line(const std::vector<std::string>& lines, const std::string& start) {
  const auto found = std::ranges::find_if(lines, [&](const auto& l) { return l.starts_with("  " + start); });
  return found == lines.end() ? "" : *found;
}

const std::string kHot = "#c62828";

TEST(Picture, DrawsAndLabelsEveryNodeAndSubscriptionAndMarksTheHotPathAlone) {
  const auto lines = lines_of(load_graph(find_graph("autoware")));
  const auto count = [&](const char* one, const std::string& other) {
    return std::ranges::count_if(lines, [&](const std::string& l) {
      return l.find(one) != std::string::npos && l.find(other) != std::string::npos;
    });
  };
  EXPECT_EQ(count("shape=", ""), 24);
  EXPECT_EQ(count("->", ""), 29);
  EXPECT_EQ(count("shape=", kHot), 8);
  EXPECT_EQ(count("->", kHot), 7);
  EXPECT_THAT(line(lines, "\"PointCloudFusion\" -> \"RayGroundFilter\""), HasSubstr(kHot));
  EXPECT_THAT(line(lines, "\"PointCloudFusion\" -> \"VoxelGridDownsampler\""),
              AllOf(HasSubstr("->"), Not(HasSubstr(kHot))));
  // Timers have their period, work its time, and topics another name than their publisher's.
  EXPECT_THAT(line(lines, "\"EuclideanClusterSettings\" ["), HasSubstr("every 25 ms"));
  EXPECT_THAT(line(lines, "\"RayGroundFilter\" ["), HasSubstr("works 4.2 ms"));
  EXPECT_THAT(line(lines, "\"EuclideanClusterDetector\" -> \"IntersectionOutput\""),
              HasSubstr("EuclideanIntersection"));
  EXPECT_THAT(line(lines, "\"FrontLidarDriver\" ->"), Not(HasSubstr("label")));
}

TEST(Picture, ColoursNodesByExecutorWithALegend) {
  const Graph graph = load_graph(find_graph("autoware"));
  const Deployment deployment = find_deployment("picas", graph, make_tasks(graph));
  const auto lines = lines_of(graph, &deployment);
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
              AllOf(HasSubstr("<b>hot_path</b>: fp-ro, fifo:88, on processors 0<"),
                    HasSubstr("<b>rest</b>: fp-ro, fifo:80")));
}

TEST(Picture, TheFirstCallbackColoursANodeOfSeveralExecutors) {
  const Graph graph = load_graph(find_graph("callbacks"));
  Deployment deployment = find_deployment("rm-threads", graph, make_tasks(graph));
  const auto driver = [&] { return line(lines_of(graph, &deployment), "\"Driver\" ["); };
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
  EXPECT_THAT(line(lines_of(graph), "\"a<b>&\\\\\" ["), HasSubstr("a&lt;b&gt;&amp;\\"));
}

}  // namespace hotpath::graph_picture_test
