// SPDX-License-Identifier: Apache-2.0
#include "graph_markers.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <utility>

#include "messages.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

using geometry_msgs::Point;
using std_msgs::ColorRGBA;
using visualization_msgs::Marker;

// Lengths in metres.
constexpr double kColumn = 4.5, kRow = 2.7;
constexpr double kWidth = 3.6, kHeight = 1.9, kThin = 0.02, kRim = 0.16;
constexpr double kTextSize = 0.44, kLine = 0.55, kTitleSize = 0.7;
// Heights, from bottom to top: arrows, rims, boxes, texts.
constexpr double kArrowZ = 0, kHotArrowZ = 0.1, kRimZ = 0.3, kBoxZ = 0.4, kTextZ = 0.6;

ColorRGBA color(float red, float green, float blue) {
  ColorRGBA result;
  result.r = red;
  result.g = green;
  result.b = blue;
  result.a = 1;
  return result;
}
const ColorRGBA kHot = color(0.83F, 0.1F, 0.1F), kEdge = color(0.55F, 0.58F, 0.62F),
                kRimColor = color(0.35F, 0.38F, 0.42F), kInk = color(0.1F, 0.1F, 0.12F);

class Drawing {
 public:
  explicit Drawing(const std_msgs::Header& header) : header_(header) {}

  void delete_all() { add("", Marker::CUBE, {}).action = Marker::DELETEALL; }

  void box(const std::string& group, const Point& centre, double width, double height,
           const ColorRGBA& color) {
    Marker& marker = add(group, Marker::CUBE, color);
    marker.pose.position = centre;
    marker.scale = at<geometry_msgs::Vector3>(width, height, kThin);
  }

  void text(const std::string& group, double x, double y, double size, const ColorRGBA& color,
            const std::string& text) {
    Marker& marker = add(group, Marker::TEXT_VIEW_FACING, color);
    marker.pose.position = at<Point>(x, y, kTextZ);
    marker.scale.z = size;
    marker.text = text;
  }

  void arrow(const std::string& group, const std::pair<Point, Point>& ends, double thickness,
             const ColorRGBA& color) {
    Marker& marker = add(group, Marker::ARROW, color);
    marker.points = {ends.first, ends.second};
    marker.scale = at<geometry_msgs::Vector3>(thickness, 3.5 * thickness, 5 * thickness);
  }

  visualization_msgs::MarkerArray take() { return std::move(drawn_); }

 private:
  Marker& add(const std::string& group, int type, const ColorRGBA& color) {
    Marker& marker = drawn_.markers.emplace_back();
    marker.header = header_;
    marker.ns = group;
    marker.id = ids_[group]++;
    marker.type = type;
    marker.pose.orientation.w = 1;
    marker.color = color;
    return marker;
  }

  const std_msgs::Header header_;
  visualization_msgs::MarkerArray drawn_;
  std::map<std::string, std::int32_t> ids_;  // next in each group
};

/// The centre of a node's box.
Point node_position(const telemetry::NodeInfo& node, double z) {
  return at<Point>(kColumn * node.layout_x(), -kRow * node.layout_y(), z);
}

/// Ends of an arrow between two boxes. A forward arrow runs from the right side of its source to
/// the left side of its target; other arrows lie on the line between the centres.
std::pair<Point, Point> arrow_ends(const Point& source, const Point& target) {
  const double dx = target.x - source.x, dy = target.y - source.y, z = source.z;
  const double half_width = kWidth / 2 + kRim, half_height = kHeight / 2 + kRim;
  if (dx > kWidth)
    return {at<Point>(source.x + half_width, source.y, z), at<Point>(target.x - half_width, target.y, z)};
  if (std::hypot(dx, dy) == 0) return {source, target};
  const double share =
      std::min({0.5, dx != 0 ? half_width / std::abs(dx) : 0.5, dy != 0 ? half_height / std::abs(dy) : 0.5});
  return {at<Point>(source.x + share * dx, source.y + share * dy, z),
          at<Point>(target.x - share * dx, target.y - share * dy, z)};
}

/// Shortens a text to fit a box.
std::string short_milliseconds(std::int64_t ns) { return milliseconds(ns, ns < 100'000'000 ? 1 : 0); }

std::string figures(const telemetry::NodeStatistics& s) {
  if (s.response_median_ns() < 0) return "-";
  return short_milliseconds(s.response_median_ns()) + " | " + short_milliseconds(s.response_p99_ns()) + " ms";
}

std::string title(const telemetry::RunInfo& run, const telemetry::Statistics* statistics) {
  std::string text = run.graph() + "   " + run.executor() + "   repetition " +
                     std::to_string(run.repetition()) + "   " + run.transport() + "   " + run.origin();
  if (statistics != nullptr) text += "   " + decimals(statistics->run_time_s(), 0) + " s";
  return text;
}

std::string chain_text(const telemetry::ChainInfo& chain, const telemetry::ChainStatistics& s) {
  return chain.name() + ":  median " + milliseconds(s.latency_median_ns(), 1) + " ms   p99 " +
         milliseconds(s.latency_p99_ns(), 1) + " ms   max " + milliseconds(s.latency_max_ns(), 1) +
         " ms   (" + std::to_string(s.samples()) + " samples)";
}

}  // namespace

Point scan_position(const telemetry::NodeInfo& lidar_driver) {
  Point position = node_position(lidar_driver, 0);
  position.x -= kColumn * 0.75;
  return position;
}

ColorRGBA utilization_color(double utilization) {
  // The square root makes small shares distinguishable; NaN counts as 0.
  const double share = utilization > 0 ? std::sqrt(std::min(utilization, 1.0)) : 0;
  const ColorRGBA idle = color(0.88F, 0.95F, 0.90F), half = color(1.0F, 0.90F, 0.40F),
                  full = color(0.95F, 0.50F, 0.10F);
  const auto mix = [](const ColorRGBA& a, const ColorRGBA& b, double t) {
    const auto part = [t](float x, float y) { return static_cast<float>(x + t * (y - x)); };
    return color(part(a.r, b.r), part(a.g, b.g), part(a.b, b.b));
  };
  return share < 0.5 ? mix(idle, half, 2 * share) : mix(half, full, 2 * share - 1);
}

std::array<std::string, 2> two_lines(const std::string& name) {
  constexpr std::size_t kShort = 13;
  if (name.size() <= kShort) return {name, ""};
  const auto is = [&](std::size_t i, int (*kind)(int)) {
    return kind(static_cast<unsigned char>(name[i])) != 0;
  };
  std::size_t best = 0;
  const auto distance = [&](std::size_t at) {
    const std::size_t middle = name.size() / 2;
    return at > middle ? at - middle : middle - at;
  };
  for (std::size_t i = 1; i + 1 < name.size(); ++i) {
    const bool word = name[i - 1] == '_' || (is(i, std::isupper) && !is(i - 1, std::isupper));
    if (word && (best == 0 || distance(i) < distance(best))) best = i;
  }
  if (best == 0) return {name, ""};
  return {name.substr(0, best), name.substr(best)};
}

visualization_msgs::MarkerArray graph_markers(const telemetry::RunInfo& run,
                                              const telemetry::Statistics* statistics,
                                              const std::string& frame) {
  Drawing draw(header(statistics != nullptr ? statistics->stamp_ns() : 0, frame));
  if (statistics == nullptr) draw.delete_all();
  double right = 0, top = 0;

  for (std::size_t i = 0; i < run.nodes().size(); ++i) {
    const telemetry::NodeInfo& node = run.nodes()[i];
    const Point rim = node_position(node, kRimZ);
    const double x = rim.x, y = rim.y;
    right = std::max(right, x);
    top = std::max(top, y);
    draw.box("rims", rim, kWidth + kRim, kHeight + kRim, node.hot() ? kHot : kRimColor);
    const double utilization = statistics != nullptr ? statistics->nodes()[i].utilization() : 0;
    draw.box("nodes", at<Point>(x, y, kBoxZ), kWidth, kHeight, utilization_color(utilization));
    // One marker per line, because RViz left-aligns the lines of a text.
    const auto [first, second] = two_lines(node.name());
    draw.text("names", x, y + (second.empty() ? kLine / 2 : kLine), kTextSize, kInk, first);
    if (!second.empty()) draw.text("names", x, y, kTextSize, kInk, second);
    if (statistics != nullptr) {
      draw.text("figures", x, y - 1.1 * kLine, kTextSize, kInk, figures(statistics->nodes()[i]));
    }
  }
  for (const telemetry::EdgeInfo& edge : run.edges()) {
    const double z = edge.hot() ? kHotArrowZ : kArrowZ;
    const Point source = node_position(run.nodes()[edge.source()], z);
    const Point target = node_position(run.nodes()[edge.target()], z);
    draw.arrow("edges", arrow_ends(source, target), edge.hot() ? 0.14 : 0.07, edge.hot() ? kHot : kEdge);
  }

  // Above the nodes, from bottom to top: legend, chains, title. Texts are centred.
  double y = top + kRow / 2 + kTitleSize;
  draw.text("legend", right / 2, y, kTextSize, kRimColor,
            "in each node: response time, median | 99th percentile; colour: share of one core");
  y += kTitleSize;
  for (std::size_t c = run.chains().size(); statistics != nullptr && c-- > 0;) {
    y += 1.3 * kTitleSize;
    draw.text("chains", right / 2, y, kTitleSize, kHot, chain_text(run.chains()[c], statistics->chains()[c]));
  }
  draw.text("title", right / 2, y + 1.4 * kTitleSize, kTitleSize, kInk, title(run, statistics));
  return draw.take();
}

}  // namespace hotpath
