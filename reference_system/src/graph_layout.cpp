// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_layout.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <map>
#include <numbers>
#include <numeric>
#include <ostream>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

constexpr int kSweeps = 12;
/// A node this close to an edge, in rows, is covered by it.
constexpr double kCovered = 0.25;

using Column = std::vector<std::uint32_t>;

/// By node: the length of the longest path from a source, found by depth-first search against the edges.
std::vector<std::size_t> depths(std::size_t nodes, const std::vector<GraphEdge>& edges) {
  std::vector<Column> sources(nodes);
  for (const GraphEdge& e : edges) sources[e.target].push_back(e.source);
  Column all(nodes);
  std::iota(all.begin(), all.end(), 0U);
  std::vector<std::size_t> depth(nodes, 0);
  for (const std::uint32_t node : cut_cycles(sources, all))
    for (const std::uint32_t source : sources[node]) depth[node] = std::max(depth[node], depth[source] + 1);
  return depth;
}

void place(const std::vector<Column>& columns, std::vector<GraphPosition>& positions) {
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t i = 0; i < columns[c].size(); ++i) {
      positions[columns[c][i]] = {static_cast<double>(c),
                                  static_cast<double>(i) - static_cast<double>(columns[c].size() - 1) / 2};
    }
  }
}

/// Side of the line a-b on which c lies.
double side(const GraphPosition& a, const GraphPosition& b, const GraphPosition& c) {
  return (b.column - a.column) * (c.row - a.row) - (b.row - a.row) * (c.column - a.column);
}

bool cross(const GraphPosition& a, const GraphPosition& b, const GraphPosition& c, const GraphPosition& d) {
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

bool covers(const GraphPosition& a, const GraphPosition& b, const GraphPosition& node) {
  if (node.column <= std::min(a.column, b.column) || node.column >= std::max(a.column, b.column))
    return false;
  const double row = a.row + (b.row - a.row) * (node.column - a.column) / (b.column - a.column);
  return std::abs(row - node.row) < kCovered;
}

constexpr std::string_view kHotColour = "#c62828";

struct Look {
  std::string_view shape, style, fill, line;
};

/// In the order of NodeType.
constexpr std::array<Look, 7> kLooks = {{
    {"ellipse", "filled", "#dcedc8", "#558b2f"},
    {"box", "filled,rounded", "#e3f2fd", "#1565c0"},
    {"hexagon", "filled", "#d1c4e9", "#4527a0"},
    {"box", "filled,diagonals", "#fff3c4", "#b28704"},
    {"octagon", "filled", "#b2ebf2", "#00838f"},
    {"note", "filled", "#eceff1", "#455a64"},
    {"component", "filled", "#ffe0b2", "#ef6c00"},
}};

const Look& look_of(const Node& node) { return kLooks[static_cast<std::size_t>(node.type)]; }

/// Escapes text for HTML-like labels and, between quotes, for names.
std::string escaped(std::string_view text) {
  constexpr std::string_view kSpecial = "&<>\"";
  constexpr std::array kEntities = {"&amp;", "&lt;", "&gt;", "&quot;"};
  std::string result;
  for (const char c : printable(text)) {
    const std::size_t special = kSpecial.find(c);
    special == std::string_view::npos ? result += c : result += kEntities[special];
  }
  return result;
}

std::string label(const Node& node) {
  std::string text = "<b>" + escaped(node.name) + "</b><br/><font point-size=\"9\" color=\"#455a64\">";
  text += to_string(node.type);
  const bool short_form = node.type != NodeType::callbacks;
  for (const Callback& callback : node.callbacks) {
    if (short_form && &callback != &node.callbacks.back()) continue;  // the last one stands for all
    if (!short_form) text += "<br/>" + escaped(callback.task.substr(node.name.size() + 1));
    if (!callback.input) text += ", every " + format_ms(callback.period) + " ms";
    if (callback.worst > Duration::zero()) text += ", works " + format_ms(callback.worst) + " ms";
  }
  return text + "</font>";
}

/// A colour as light as the fills of node types. Steps of the golden ratio keep neighbouring hues
/// apart for any number of executors.
std::string executor_colour(std::size_t executor) {
  double turns = 0;
  const double hue = std::modf(static_cast<double>(executor) * std::numbers::phi, &turns);
  return std::to_string(hue) + " 0.35 1.0";
}

/// The legend's text for an executor.
std::string description(const DeployedExecutor& executor) {
  std::string text = "<b>" + escaped(executor.name) + "</b>: " + escaped(executor.executor) + ", " +
                     to_string(executor.policy);
  const char* before = ", on processors ";
  for (const int processor : executor.processors) {
    text += before + std::to_string(processor);
    before = ", ";
  }
  return text;
}

void write_node(std::ostream& out, const Node& node, const std::string& fill, bool hot) {
  const Look& look = look_of(node);
  out << "  " << std::quoted(printable(node.name)) << " [shape=" << look.shape << ", style=\"" << look.style
      << "\", fillcolor=\"" << fill << "\", label=<" << label(node) << ">, color=\"";
  hot ? out << kHotColour << "\", penwidth=2.6];\n" : out << look.line << "\"];\n";
}

/// Writes the legend as one node with a table, which keeps its rows together. Node names of a graph
/// have no slash.
void write_legend(std::ostream& out, const Deployment& deployment) {
  out << "  subgraph cluster_legend {\n    label=" << std::quoted(printable(deployment.name))
      << "; fontname=\"Helvetica\"; fontsize=11;\n    "
      << std::quoted(printable("deployment/" + deployment.name))
      << " [shape=plain, label=<<table border=\"0\">";
  for (std::size_t e = 0; e < deployment.executors.size(); ++e) {
    out << "<tr><td border=\"1\" bgcolor=\"" << executor_colour(e)
        << "\" width=\"20\"></td><td align=\"left\">" << description(deployment.executors[e]) << "</td></tr>";
  }
  out << "</table>>];\n  }\n";
}

void write_edge(std::ostream& out, const Node& from, const Node& to, const GraphEdge& edge) {
  out << "  " << std::quoted(printable(from.name)) << " -> " << std::quoted(printable(to.name)) << " [";
  if (edge.topic != from.name) out << "label=<" << escaped(edge.topic) << ">, ";
  edge.hot ? out << "color=\"" << kHotColour << "\", penwidth=2.6, weight=4" : out << "weight=1";
  out << "];\n";
}

}  // namespace

bool on_hot_path(const Graph& graph, const Node& node) {
  const auto is_it = [&](const std::string& name) { return graph.find(name) == &node; };
  return !graph.chains.empty() && std::ranges::any_of(graph.chains.front().nodes, is_it);
}

std::vector<GraphEdge> graph_edges(const Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  std::vector<bool> hot(tasks.set.size(), false);
  const std::vector<ChainIndex> chains = index_chains(graph, tasks);
  if (!chains.empty())
    for (const std::vector<TaskId>& node : chains.front().nodes)
      for (const TaskId id : node) hot[id] = true;
  std::map<std::tuple<std::uint32_t, std::ptrdiff_t, std::uint32_t>, bool> is_hot;  // by node, output, node
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const std::uint32_t source = tasks.origin[id].node;
    const Node& node = graph.nodes[source];
    for (std::size_t p = 0; p < tasks.readers[id].size(); ++p) {
      const auto output = std::ranges::find(node.outputs, tasks.callbacks[id].publishes[p].topic);
      for (const TaskId to : tasks.readers[id][p])
        is_hot[{source, output - node.outputs.begin(), tasks.origin[to].node}] |=
            hot[id] && hot[to] && source != chains.front().sink;
    }
  }
  std::vector<GraphEdge> edges;
  for (const auto& [way, on_hot_path] : is_hot) {
    const auto& [source, output, target] = way;
    const std::string& topic = graph.nodes[source].outputs[static_cast<std::size_t>(output)];
    edges.push_back({source, target, topic, on_hot_path});
  }
  return edges;
}

std::size_t crossings(const std::vector<GraphEdge>& edges, const std::vector<GraphPosition>& positions) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const GraphPosition &a = positions[edges[i].source], &b = positions[edges[i].target];
    for (std::size_t k = i + 1; k < edges.size(); ++k)
      count += cross(a, b, positions[edges[k].source], positions[edges[k].target]);
    for (const GraphPosition& node : positions) count += covers(a, b, node);
  }
  return count;
}

std::vector<GraphPosition> graph_layout(const Graph& graph) {
  const std::vector<GraphEdge> edges = graph_edges(graph);
  const std::vector<std::size_t> depth = depths(graph.nodes.size(), edges);
  std::vector<Column> columns;
  for (std::uint32_t n = 0; n < depth.size(); ++n) {
    if (columns.size() <= depth[n]) columns.resize(depth[n] + 1);
    columns[depth[n]].push_back(n);
  }
  std::vector<GraphPosition> positions(graph.nodes.size());
  place(columns, positions);
  std::vector<GraphPosition> best = positions;
  std::size_t fewest = crossings(edges, best);

  // Alternate sweeps: to the right by the rows of sources, to the left by the rows of targets.
  for (int sweep = 0; sweep < kSweeps && fewest > 0; ++sweep) {
    const bool right = sweep % 2 == 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      Column& column = columns[right ? i : columns.size() - 1 - i];
      std::vector<double> mean(graph.nodes.size());
      for (const std::uint32_t node : column) {
        double sum = 0, count = 0;
        for (const GraphEdge& e : edges) {
          if ((right ? e.target : e.source) != node) continue;
          sum += positions[right ? e.source : e.target].row;
          ++count;
        }
        mean[node] = count > 0 ? sum / count : positions[node].row;
      }
      std::ranges::stable_sort(column, {}, [&](std::uint32_t node) { return mean[node]; });
      place(columns, positions);
    }
    const std::size_t now = crossings(edges, positions);
    if (now < fewest) best = positions;
    fewest = std::min(fewest, now);
  }
  return best;
}

void write_dot(std::ostream& out, const Graph& graph, const Deployment* deployment) {
  std::vector<std::string> fills;  // by node
  for (const Node& node : graph.nodes) fills.emplace_back(look_of(node).fill);
  const GraphTasks tasks = make_tasks(graph);
  for (TaskId id = tasks.set.size(); deployment != nullptr && id-- > 0;)
    fills[tasks.origin[id].node] = executor_colour(deployment->executor_of[id]);
  out << "digraph " << std::quoted(printable(graph.name)) << " {\n"
      << "  rankdir=LR; nodesep=0.4; ranksep=0.35; bgcolor=white; pad=0.2;\n"
      << "  node [fontname=\"Helvetica\", fontsize=11, margin=\"0.1,0.06\", penwidth=1.1];\n"
      << "  edge [fontname=\"Helvetica\", fontsize=9, color=\"#78909c\", arrowsize=0.7];\n";
  for (std::size_t n = 0; n < graph.nodes.size(); ++n)
    write_node(out, graph.nodes[n], fills[n], on_hot_path(graph, graph.nodes[n]));
  if (deployment != nullptr) write_legend(out, *deployment);
  for (const GraphEdge& edge : graph_edges(graph))
    write_edge(out, graph.nodes[edge.source], graph.nodes[edge.target], edge);
  out << "}\n";
}

}  // namespace hotpath
