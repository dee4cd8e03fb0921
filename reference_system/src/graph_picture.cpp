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

class Picture {
 public:
  Picture(std::ostream& out, const Graph& graph) : out_(out), graph_(graph) {
    for (const Node& node : graph.nodes) fills_.emplace_back(look_of(node).fill);
  }

  void colour_by_executor(const GraphTasks& tasks, const Deployment& deployment) {
    deployment_ = &deployment;
    for (TaskId id = tasks.set.size(); id-- > 0;) {
      fills_[tasks.origin[id].node] = executor_colour(deployment.executor_of[id]);
    }
  }

  void draw() {
    out_ << "digraph " << identifier(graph_.name) << " {\n"
         << "  rankdir=LR; nodesep=0.4; ranksep=0.35; bgcolor=white; pad=0.2;\n"
         << "  node [fontname=\"Helvetica\", fontsize=11, margin=\"0.1,0.06\", penwidth=1.1];\n"
         << "  edge [fontname=\"Helvetica\", fontsize=9, color=\"#78909c\", arrowsize=0.7];\n";
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) draw_node(graph_.nodes[n], fills_[n]);
    if (deployment_ != nullptr) draw_legend();
    for (const GraphEdge& edge : graph_edges(graph_)) draw_edge(edge);
    out_ << "}\n";
  }

 private:
  void draw_node(const Node& node, const std::string& fill) {
    const Look& look = look_of(node);
    out_ << "  " << identifier(node.name) << " [shape=" << look.shape << ", style=\"" << look.style
         << "\", fillcolor=\"" << fill << "\", label=<" << label(node) << ">, color=\"";
    if (on_hot_path(graph_, node)) {
      out_ << kHotColour << "\", penwidth=2.6];\n";
    } else {
      out_ << look.line << "\"];\n";
    }
  }

  /// Draws the legend as one node with a table, which keeps its rows together. Node names of a
  /// graph have no slash.
  void draw_legend() {
    out_ << "  subgraph cluster_legend {\n    label=" << identifier(deployment_->name)
         << "; fontname=\"Helvetica\"; fontsize=11;\n    " << identifier("deployment/" + deployment_->name)
         << " [shape=plain, label=<<table border=\"0\">";
    for (std::size_t e = 0; e < deployment_->executors.size(); ++e) {
      out_ << "<tr><td border=\"1\" bgcolor=\"" << executor_colour(e)
           << "\" width=\"20\"></td><td align=\"left\">" << description(deployment_->executors[e])
           << "</td></tr>";
    }
    out_ << "</table>>];\n  }\n";
  }

  void draw_edge(const GraphEdge& edge) {
    const Node& from = graph_.nodes[edge.source];
    out_ << "  " << identifier(from.name) << " -> " << identifier(graph_.nodes[edge.target].name) << " [";
    if (edge.topic != from.name) out_ << "label=<" << escaped(edge.topic) << ">, ";
    if (edge.hot) {
      out_ << "color=\"" << kHotColour << "\", penwidth=2.6, weight=4";
    } else {
      out_ << "weight=1";
    }
    out_ << "];\n";
  }

  std::ostream& out_;
  const Graph& graph_;
  std::vector<std::string> fills_;  // by node
  const Deployment* deployment_ = nullptr;
};

}  // namespace

void write_dot(std::ostream& out, const Graph& graph) { Picture(out, graph).draw(); }

void write_dot(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment) {
  Picture picture(out, graph);
  picture.colour_by_executor(tasks, deployment);
  picture.draw();
}

}  // namespace hotpath
