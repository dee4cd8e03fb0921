// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_picture.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_layout.hpp"
#include "hotpath/reference_system/graph_text.hpp"

namespace hotpath {

namespace {

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

/// A quoted identifier.
std::string identifier(std::string_view text) {
  std::string result = "\"";
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
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
  out << "  " << identifier(node.name) << " [shape=" << look.shape << ", style=\"" << look.style
      << "\", fillcolor=\"" << fill << "\", label=<" << label(node) << ">, color=\"";
  hot ? out << kHotColour << "\", penwidth=2.6];\n" : out << look.line << "\"];\n";
}

/// Writes the legend as one node with a table, which keeps its rows together. Node names of a graph
/// have no slash.
void write_legend(std::ostream& out, const Deployment& deployment) {
  out << "  subgraph cluster_legend {\n    label=" << identifier(deployment.name)
      << "; fontname=\"Helvetica\"; fontsize=11;\n    " << identifier("deployment/" + deployment.name)
      << " [shape=plain, label=<<table border=\"0\">";
  for (std::size_t e = 0; e < deployment.executors.size(); ++e) {
    out << "<tr><td border=\"1\" bgcolor=\"" << executor_colour(e)
        << "\" width=\"20\"></td><td align=\"left\">" << description(deployment.executors[e]) << "</td></tr>";
  }
  out << "</table>>];\n  }\n";
}

void write_edge(std::ostream& out, const Node& from, const Node& to, const GraphEdge& edge) {
  out << "  " << identifier(from.name) << " -> " << identifier(to.name) << " [";
  if (edge.topic != from.name) out << "label=<" << escaped(edge.topic) << ">, ";
  edge.hot ? out << "color=\"" << kHotColour << "\", penwidth=2.6, weight=4" : out << "weight=1";
  out << "];\n";
}

/// `fills`: by node. Without a deployment there is no legend.
void write_picture(std::ostream& out, const Graph& graph, const std::vector<std::string>& fills,
                   const Deployment* deployment) {
  out << "digraph " << identifier(graph.name) << " {\n"
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

std::vector<std::string> fills_by_type(const Graph& graph) {
  std::vector<std::string> fills;
  for (const Node& node : graph.nodes) fills.emplace_back(look_of(node).fill);
  return fills;
}

}  // namespace

void write_dot(std::ostream& out, const Graph& graph) {
  write_picture(out, graph, fills_by_type(graph), nullptr);
}

void write_dot(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment) {
  std::vector<std::string> fills = fills_by_type(graph);
  for (TaskId id = tasks.set.size(); id-- > 0;)
    fills[tasks.origin[id].node] = executor_colour(deployment.executor_of[id]);
  write_picture(out, graph, fills, &deployment);
}

}  // namespace hotpath
