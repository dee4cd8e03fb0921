// SPDX-License-Identifier: Apache-2.0
// The conversion of telemetry, without DDS and ROS.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "graph_markers.hpp"
#include "lidar.hpp"
#include "messages.hpp"
#include "node_health.hpp"
#include "run_info.hpp"
#include "text.hpp"

namespace hotpath::telemetry_view_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

telemetry::NodeInfo node(const std::string& name, const std::string& type, bool hot, double x, double y) {
  telemetry::NodeInfo info;
  info.name(name);
  info.type(type);
  info.hot(hot);
  info.layout_x(x);
  info.layout_y(y);
  return info;
}

telemetry::EdgeInfo edge(std::uint32_t source, std::uint32_t target, const std::string& topic, bool hot) {
  telemetry::EdgeInfo info;
  info.source(source);
  info.target(target);
  info.topic(topic);
  info.hot(hot);
  return info;
}

/// Two LiDARs and a map; one LiDAR feeds two fusions.
telemetry::RunInfo run() {
  telemetry::RunInfo info;
  info.run_id("r");
  info.graph("small");
  info.nodes({node("FrontLidarDriver", "sensor", true, 0, 0), node("RearLidarDriver", "sensor", true, 0, 1),
              node("Map", "sensor", false, 0, 2), node("Fusion", "fusion", true, 1, 0),
              node("Sink", "command", true, 2, 0)});
  info.edges({edge(0, 3, "front", true), edge(1, 3, "rear", true), edge(0, 4, "front", true),
              edge(2, 3, "map", false)});
  telemetry::ChainInfo chain;
  chain.name("hot path");
  chain.sink(4);
  info.chains({chain});
  return info;
}

telemetry::Statistics statistics(const telemetry::RunInfo& info) {
  telemetry::Statistics s;
  s.nodes().resize(info.nodes().size());
  s.chains().resize(info.chains().size());
  return s;
}

using diagnostic_msgs::DiagnosticStatus;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

std::vector<Marker> of_group(const MarkerArray& set, const std::string& group) {
  std::vector<Marker> result;
  std::copy_if(set.markers.begin(), set.markers.end(), std::back_inserter(result),
               [&](const Marker& m) { return m.ns == group; });
  return result;
}

bool is_red(const std_msgs::ColorRGBA& c) { return c.r > 0.7F && c.g < 0.3F && c.b < 0.3F; }

TEST(GraphMarkers, DrawEachNodeAndEdgeAndTheHotPathInRed) {
  const auto info = run();
  auto now = statistics(info);
  const MarkerArray set = graph_markers(info, &now, "frame");
  const auto rims = of_group(set, "rims"), edges = of_group(set, "edges");
  ASSERT_EQ(rims.size(), info.nodes().size());
  ASSERT_EQ(edges.size(), info.edges().size());
  for (std::size_t i = 0; i < rims.size(); ++i) EXPECT_EQ(is_red(rims[i].color), info.nodes()[i].hot());
  for (std::size_t i = 0; i < edges.size(); ++i) EXPECT_EQ(is_red(edges[i].color), info.edges()[i].hot());
  EXPECT_EQ(of_group(set, "figures").size(), info.nodes().size());
  ASSERT_EQ(of_group(set, "chains").size(), 1U);
  EXPECT_THAT(of_group(set, "chains")[0].text, HasSubstr("hot path"));
  now.nodes()[0].utilization(0.5);
  const MarkerArray later = graph_markers(info, &now, "frame");
  const auto same = [](const Marker& a, const Marker& b) { return a.ns == b.ns && a.id == b.id; };
  EXPECT_TRUE(
      std::equal(set.markers.begin(), set.markers.end(), later.markers.begin(), later.markers.end(), same))
      << "they keep their identities";
}

TEST(GraphMarkers, AreThereBeforeTheFirstStatistics) {
  const auto info = run();
  const auto now = statistics(info);
  const MarkerArray before = graph_markers(info, nullptr, "frame"),
                    after = graph_markers(info, &now, "frame");
  EXPECT_EQ(of_group(before, "nodes").size(), info.nodes().size());
  EXPECT_TRUE(of_group(before, "figures").empty());
  EXPECT_EQ(before.markers[0].action, Marker::DELETEALL);
  EXPECT_EQ(after.markers[0].action, Marker::ADD);
  EXPECT_EQ(of_group(before, "title")[0].id, of_group(after, "title")[0].id);
}

TEST(GraphMarkers, ShowUtilizationByColour) {
  EXPECT_GT(utilization_color(0).b, utilization_color(0.2).b);
  EXPECT_GT(utilization_color(0.3).g, utilization_color(1).g);
  EXPECT_EQ(utilization_color(5).g, utilization_color(1).g);
  EXPECT_EQ(utilization_color(std::nan("")).g, utilization_color(0).g);
}

TEST(GraphMarkers, BreakLongNamesBetweenWords) {
  EXPECT_THAT(two_lines("Visualizer"), ElementsAre("Visualizer", ""));
  EXPECT_THAT(two_lines("ObjectCollisionEstimator"), ElementsAre("ObjectCollision", "Estimator"));
  EXPECT_THAT(two_lines("lidar_of_the_front_left"), ElementsAre("lidar_of_", "the_front_left"));
  EXPECT_THAT(two_lines("abcdefghijklmnopqrst"), ElementsAre("abcdefghijklmnopqrst", ""));
}

TEST(NodeHealth, ComparesRatesAndTheQueueWithTheLimits) {
  telemetry::NodeStatistics before, now;
  now.queued(4);
  EXPECT_EQ(node_health("n", now, now, 1).level, DiagnosticStatus::OK);
  EXPECT_EQ(node_health("n", now, now, 1).message, "OK");
  now.skipped(10);
  EXPECT_EQ(node_health("n", before, now, 5).level, DiagnosticStatus::WARN);
  EXPECT_EQ(node_health("n", before, now, 2).level, DiagnosticStatus::ERROR);
  EXPECT_EQ(node_health("n", before, now, 11).level, DiagnosticStatus::OK);
  EXPECT_EQ(node_health("n", now, now, 2).level, DiagnosticStatus::OK);
  now.overruns(5);
  EXPECT_EQ(node_health("n", before, now, 5).message,
            "2.0 skipped jobs per second, 1.0 deadline overruns per second");
  now = {};
  now.queued(5);
  EXPECT_EQ(node_health("n", before, now, 0).level, DiagnosticStatus::WARN);
  now.queued(20);
  EXPECT_EQ(node_health("n", before, now, 0).level, DiagnosticStatus::ERROR);
}

TEST(Lidars, AreTheSensorsOfTheHotPathOnceEachAndNotMoreThan1000) {
  auto info = run();
  const auto found = lidars(info);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].topic, "front");
  EXPECT_EQ(found[0].node, 0U);
  EXPECT_EQ(found[1].topic, "rear");
  for (int i = 0; i < 2000; ++i) info.edges().push_back(edge(0, 3, std::to_string(i), true));
  EXPECT_THAT(lidars(info), SizeIs(1000));
}

TEST(StandInScan, HasTheSizeOfTheMessageAndTurns) {
  const auto number = [](const sensor_msgs::PointCloud2& cloud, std::size_t index) {
    float value = 0;
    std::memcpy(&value, cloud.data.data() + index * sizeof value, sizeof value);
    return value;
  };
  const auto first = stand_in_scan({0, 17, 0}, "lidar"), second = stand_in_scan({0, 18, 25}, "lidar");
  EXPECT_EQ(first.data.size(), 4096U);
  EXPECT_EQ(first.width * first.point_step, first.row_step);
  EXPECT_EQ(first.header.stamp.toNSec(), 17U);
  EXPECT_EQ(first.header.frame_id, "lidar");
  EXPECT_FLOAT_EQ(number(first, 0), 1);   // x of the scan's start
  EXPECT_FLOAT_EQ(number(second, 1), 1);  // after a quarter turn, y
}

TEST(ToTime, StaysWithinTheRangeOfRos1) {
  EXPECT_EQ(to_time(1'500'000'000).toNSec(), 1'500'000'000U);
  EXPECT_TRUE(to_time(-1).isZero());
  EXPECT_EQ(to_time(std::numeric_limits<std::int64_t>::max()).sec, std::numeric_limits<std::uint32_t>::max());
}

TEST(RunMetadata, IsJsonWithRosNames) {
  auto info = run();
  info.facts(R"({"seed": 3})");
  const auto json = nlohmann::json::parse(run_metadata(info, {"F", "R", "M", "Fu", "S"}, {"hot_path"}));
  EXPECT_EQ(json["nodes"][0]["ros_name"], "F");
  EXPECT_EQ(json["edges"][1]["source"], "RearLidarDriver");
  EXPECT_EQ(json["chains"][0],
            (nlohmann::json{{"name", "hot path"}, {"ros_name", "hot_path"}, {"sink", "Sink"}}));
  EXPECT_EQ(json["facts"]["seed"], 3);
  info.facts("no json \xff");
  EXPECT_TRUE(nlohmann::json::accept(run_metadata(info, {"F", "R", "M", "Fu", "S"}, {"hot_path"})));
}

TEST(RunDefect, IsAnIndexOutOfRangeOrMoreThanCanBeShown) {
  EXPECT_EQ(run_defect(run()), "");
  using Run = telemetry::RunInfo;
  const std::pair<std::function<void(Run&)>, const char*> defects[] = {
      {[](Run& r) { r.edges()[0].target(5); }, "front"},
      {[](Run& r) { r.chains()[0].sink(9); }, "hot path"},
      {[](Run& r) { r.nodes().resize(20'001); }, "it has 20001 nodes, and the bridge shows at most 20000"},
      {[](Run& r) { r.edges().resize(200'001); }, "200001 edges"},
      {[](Run& r) { r.chains().resize(20'001); }, "20001 chains"},
      {[](Run& r) { r.facts(std::string((16U << 20) + 1, ' ')); }, "bytes of facts"},
      {[](Run& r) { r.nodes()[0].name(std::string(64U << 20, 'a')); }, "bytes, and"}};
  for (const auto& [change, defect] : defects) {
    auto info = run();
    change(info);
    EXPECT_THAT(run_defect(info), HasSubstr(defect));
  }
  auto info = run();
  info.nodes().resize(20'000);
  info.edges().resize(200'000);
  info.chains().resize(20'000);
  EXPECT_EQ(run_defect(info), "");
}

TEST(RunDefect, IsAPlaceWhereNothingCanBeDrawn) {
  for (const double place : {std::nan(""), std::numeric_limits<double>::infinity(), -1e308}) {
    auto info = run();
    info.nodes()[1].layout_x(place);
    EXPECT_THAT(run_defect(info), HasSubstr("RearLidarDriver"));
    info = run();
    info.nodes()[1].layout_y(place);
    EXPECT_THAT(run_defect(info), HasSubstr("RearLidarDriver"));
  }
}

TEST(RunMetadata, LeavesOutWhatIsNestedTooDeep) {
  auto info = run();
  info.facts(R"({"seed": 3, "deep": )" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}");
  const std::string text = run_metadata(info, {"F", "R", "M", "Fu", "S"}, {"hot_path"});
  EXPECT_LT(text.size(), 10'000U);
  EXPECT_EQ(nlohmann::json::parse(text)["facts"]["seed"], 3);
}

TEST(Decimals, AreFewForAnyNumber) {
  EXPECT_EQ(decimals(123456789.125, 1), "123456789.1");
  for (const double value : {1e308, -1e308, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_LE(decimals(value, 3).size(), 30U);
  }
}

TEST(MakePrintable, LeavesNothingToDrawThatIsNot) {
  const std::string hostile = "\x1b[2J\xff" + std::string(1'000'000, 'a');
  auto info = run();
  for (std::string* text : {&info.graph(), &info.executor(), &info.transport(), &info.origin()})
    *text = hostile;
  for (auto& node : info.nodes()) node.name(hostile), node.type(hostile);
  info.chains()[0].name(hostile);
  info.topic_prefix(hostile);
  make_printable(info);
  EXPECT_EQ(info.topic_prefix(), hostile);
  EXPECT_LE(info.nodes()[0].type().size(), 200U);
  const auto now = statistics(info);
  for (const Marker& marker : graph_markers(info, &now, "frame").markers) {
    EXPECT_EQ(marker.text, printable(marker.text, 1000));
  }
  EXPECT_THAT(of_group(graph_markers(info, &now, "frame"), "title")[0].text, HasSubstr("\\x1b[2J\\xff"));
}

}  // namespace hotpath::telemetry_view_test
