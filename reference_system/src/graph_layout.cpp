// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_layout.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

namespace {

/// The tasks of the graph's first chain.
std::vector<bool> hot_tasks(const Graph& graph, const GraphTasks& tasks) {
  std::vector<bool> hot(tasks.set.size(), false);
  if (graph.chains.empty()) return hot;
  for (const std::string& node : graph.chains.front().nodes) {
    for (const TaskId id : tasks_named(graph, tasks, node)) hot[id] = true;
  }
  return hot;
}

/// Whether a hot task publishes the edge's topic to a hot task.
bool is_hot(const GraphEdge& edge, const GraphTasks& tasks, const std::vector<bool>& hot) {
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!hot[id] || tasks.origin[id].node != edge.source) continue;
    for (std::size_t p = 0; p < tasks.readers[id].size(); ++p) {
      if (tasks.callbacks[id].publishes[p].topic != edge.topic) continue;
      const auto reaches = [&](TaskId to) { return hot[to] && tasks.origin[to].node == edge.target; };
      const std::vector<TaskId>& readers = tasks.readers[id][p];
      if (std::any_of(readers.begin(), readers.end(), reaches)) return true;
    }
  }
  return false;
}

constexpr int kSweeps = 12;
/// A node this close to an edge, in rows, is covered by it.
constexpr double kCovered = 0.25;

using Column = std::vector<std::uint32_t>;

/// The longest path from a source to each node, found by depth-first search against the edges.
class Depths {
 public:
  Depths(std::size_t nodes, const std::vector<GraphEdge>& edges)
      : state_(nodes, State::unseen), depth_(nodes, 0) {
    sources_.resize(nodes);
    for (const GraphEdge& e : edges) sources_[e.target].push_back(e.source);
    for (std::uint32_t n = 0; n < nodes; ++n) visit(n);
  }
  const std::vector<std::size_t>& values() const { return depth_; }

 private:
  enum class State : std::uint8_t { unseen, open, done };

  void visit(std::uint32_t node) {
    if (state_[node] != State::unseen) return;
    state_[node] = State::open;
    for (const std::uint32_t source : sources_[node]) {
      visit(source);
      if (state_[source] == State::done) depth_[node] = std::max(depth_[node], depth_[source] + 1);
    }
    state_[node] = State::done;
  }

  std::vector<std::vector<std::uint32_t>> sources_;
  std::vector<State> state_;
  std::vector<std::size_t> depth_;
};

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

}  // namespace

bool on_hot_path(const Graph& graph, const Node& node) {
  if (graph.chains.empty()) return false;
  const std::vector<std::string>& nodes = graph.chains.front().nodes;
  return std::any_of(nodes.begin(), nodes.end(),
                     [&](const std::string& name) { return graph.find(name) == &node; });
}

std::vector<GraphEdge> graph_edges(const Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  const std::vector<bool> hot = hot_tasks(graph, tasks);
  std::vector<GraphEdge> edges;
  for (std::uint32_t s = 0; s < graph.nodes.size(); ++s) {
    const Node& source = graph.nodes[s];
    const bool leads_on = !graph.chains.empty() && graph.find(graph.chains.front().sink) != &source;
    for (const std::string& topic : source.outputs) {
      for (std::uint32_t t = 0; t < graph.nodes.size(); ++t) {
        const Node& target = graph.nodes[t];
        const auto subscribes = [&](const Input& input) { return input.topic == topic; };
        if (std::none_of(target.inputs.begin(), target.inputs.end(), subscribes)) continue;
        edges.push_back({s, t, topic, false});
        edges.back().hot = leads_on && is_hot(edges.back(), tasks, hot);
      }
    }
  }
  return edges;
}

std::size_t crossings(const std::vector<GraphEdge>& edges, const std::vector<GraphPosition>& positions) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const GraphPosition &a = positions[edges[i].source], &b = positions[edges[i].target];
    for (std::size_t k = i + 1; k < edges.size(); ++k) {
      count += cross(a, b, positions[edges[k].source], positions[edges[k].target]);
    }
    count += static_cast<std::size_t>(std::count_if(positions.begin(), positions.end(),
                                                    [&](const auto& node) { return covers(a, b, node); }));
  }
  return count;
}

std::vector<GraphPosition> graph_layout(const Graph& graph) {
  const std::vector<GraphEdge> edges = graph_edges(graph);
  const std::vector<std::size_t> depth = Depths(graph.nodes.size(), edges).values();
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
      std::stable_sort(column.begin(), column.end(),
                       [&](std::uint32_t a, std::uint32_t b) { return mean[a] < mean[b]; });
      place(columns, positions);
    }
    const std::size_t now = crossings(edges, positions);
    if (now < fewest) {
      fewest = now;
      best = positions;
    }
  }
  return best;
}

}  // namespace hotpath
