// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_picture.hpp"

#include <algorithm>
#include <array>
#include <ostream>
#include <string_view>

#include "graph_text.hpp"

namespace hotpath {

namespace {

constexpr std::string_view kHotColour = "#c62828";

struct Look {
  std::string_view type, shape, style, fill, line;
};

/// In the order of NodeType.
constexpr std::array<Look, 6> kLooks = {{
    {"sensor", "ellipse", "filled", "#dcedc8", "#558b2f"},
    {"transform", "box", "filled,rounded", "#e3f2fd", "#1565c0"},
    {"fusion", "hexagon", "filled", "#d1c4e9", "#4527a0"},
    {"cyclic", "box", "filled,diagonals", "#fff3c4", "#b28704"},
    {"intersection", "octagon", "filled", "#b2ebf2", "#00838f"},
    {"command", "note", "filled", "#eceff1", "#455a64"},
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
  text += look_of(node).type;
  if (node.period > Duration::zero()) text += ", every " + format_ms(node.period) + " ms";
  if (node.execution_time > Duration::zero()) text += ", works " + format_ms(node.execution_time) + " ms";
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
    for (const Node& node : graph_.nodes) {
      for (std::size_t o = 0; o < node.outputs.size(); ++o) draw_edges(node, node.outputs[o]);
    }
    out_ << "}\n";
  }

 private:
  bool hot(const Node& node) const {
    if (graph_.chains.empty()) return false;
    const auto& nodes = graph_.chains.front().nodes;
    return std::find(nodes.begin(), nodes.end(), node.name) != nodes.end();
  }

  void draw_node(const Node& node) {
    const Look& look = look_of(node);
    out_ << "  " << quoted(node.name) << " [shape=" << look.shape << ", style=\"" << look.style
         << "\", fillcolor=\"" << look.fill << "\", label=<" << label(node) << ">, color=\"";
    if (hot(node)) {
      out_ << kHotColour << "\", penwidth=2.6];\n";
    } else {
      out_ << look.line << "\"];\n";
    }
  }

  void draw_edges(const Node& from, const std::string& topic) {
    for (const Node& to : graph_.nodes) {
      const auto subscribes = [&](const Input& input) { return input.topic == topic; };
      if (std::none_of(to.inputs.begin(), to.inputs.end(), subscribes)) continue;
      out_ << "  " << quoted(from.name) << " -> " << quoted(to.name) << " [";
      if (topic != from.name) out_ << "label=<" << escaped(topic) << ">, ";
      // What a chain's sink publishes is no part of the chain.
      if (hot(from) && hot(to) && from.name != graph_.chains.front().sink) {
        out_ << "color=\"" << kHotColour << "\", penwidth=2.6, weight=4";
      } else {
        out_ << "weight=1";
      }
      out_ << "];\n";
    }
  }

  std::ostream& out_;
  const Graph& graph_;
};

}  // namespace

void write_dot(std::ostream& out, const Graph& graph) { Picture(out, graph).draw(); }

}  // namespace hotpath
