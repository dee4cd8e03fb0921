// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_picture.hpp"

#include <array>
#include <ostream>
#include <string_view>

#include "graph_text.hpp"
#include "hotpath/reference_system/graph_edges.hpp"

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

/// For HTML-like labels and, between quotes, for names.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// A quoted identifier.
std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string label(const Node& node) {
  std::string text = "<b>" + escaped(node.name) + "</b><br/><font point-size=\"9\" color=\"#455a64\">";
  text += to_string(node.type);
  if (node.period > Duration::zero()) text += ", every " + format_ms(node.period) + " ms";
  if (node.execution_time > Duration::zero()) text += ", works " + format_ms(node.execution_time) + " ms";
  for (const Callback& callback : node.callbacks) {
    text += "<br/>" + escaped(callback.task.substr(node.name.size() + 1));
    if (!callback.input) text += ", every " + format_ms(callback.period) + " ms";
    if (callback.worst > Duration::zero()) text += ", works " + format_ms(callback.worst) + " ms";
  }
  return text + "</font>";
}

class Picture {
 public:
  Picture(std::ostream& out, const Graph& graph) : out_(out), graph_(graph) {}

  void draw() {
    out_ << "digraph " << quoted(graph_.name) << " {\n"
         << "  rankdir=LR; nodesep=0.4; ranksep=0.35; bgcolor=white; pad=0.2;\n"
         << "  node [fontname=\"Helvetica\", fontsize=11, margin=\"0.1,0.06\", penwidth=1.1];\n"
         << "  edge [fontname=\"Helvetica\", fontsize=9, color=\"#78909c\", arrowsize=0.7];\n";
    for (const Node& node : graph_.nodes) draw_node(node);
    for (const GraphEdge& edge : graph_edges(graph_)) draw_edge(edge);
    out_ << "}\n";
  }

 private:
  void draw_node(const Node& node) {
    const Look& look = look_of(node);
    out_ << "  " << quoted(node.name) << " [shape=" << look.shape << ", style=\"" << look.style
         << "\", fillcolor=\"" << look.fill << "\", label=<" << label(node) << ">, color=\"";
    if (on_hot_path(graph_, node)) {
      out_ << kHotColour << "\", penwidth=2.6];\n";
    } else {
      out_ << look.line << "\"];\n";
    }
  }

  void draw_edge(const GraphEdge& edge) {
    const Node& from = graph_.nodes[edge.source];
    out_ << "  " << quoted(from.name) << " -> " << quoted(graph_.nodes[edge.target].name) << " [";
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
};

}  // namespace

void write_dot(std::ostream& out, const Graph& graph) { Picture(out, graph).draw(); }

}  // namespace hotpath
