// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_chains.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

namespace {

/// The tasks that a task's data reaches next. Includes other tasks of its node only if they lead
/// further than the task itself: not the other inputs of a fusion.
std::vector<TaskId> next_of(const GraphTasks& tasks, TaskId id) {
  const std::vector<TaskId>& own = tasks.set[id].feeds;
  std::vector<TaskId> next = tasks.downstream(id);
  std::erase_if(next, [&](TaskId other) {
    const std::vector<TaskId>& theirs = tasks.set[other].feeds;
    return tasks.origin[other].node == tasks.origin[id].node && !theirs.empty() &&
           std::ranges::all_of(theirs, [&](TaskId fed) { return std::ranges::count(own, fed) > 0; });
  });
  return next;
}

/// A path of tasks from a timer.
struct Path {
  std::vector<TaskId> tasks;
  Duration work{};

  [[nodiscard]] bool is_larger_than(const Path& other) const {
    return std::pair(tasks.size(), work) > std::pair(other.tasks.size(), other.work);
  }
};

/// The largest paths from one timer, over the graph without the edges that close cycles.
std::vector<Path> largest_paths(const GraphTasks& tasks, const std::vector<std::vector<TaskId>>& downstream,
                                TaskId timer) {
  enum class State : std::uint8_t { unseen, open, done };
  std::vector<State> state(tasks.set.size(), State::unseen);
  std::vector<std::vector<TaskId>> edges(state.size());
  std::vector<TaskId> order;  // each task follows the tasks that it leads to
  const std::function<void(TaskId)> visit = [&](TaskId id) {
    state[id] = State::open;
    for (const TaskId next : downstream[id]) {
      if (state[next] == State::open) continue;  // closes a cycle
      edges[id].push_back(next);
      if (state[next] == State::unseen) visit(next);
    }
    state[id] = State::done;
    order.push_back(id);
  };
  visit(timer);
  std::vector<std::optional<Path>> best(state.size());
  best[timer] = Path{{timer}, tasks.set[timer].wcet};
  std::vector<Path> paths;
  for (auto id = order.rbegin(); id != order.rend(); ++id) {
    const Path& path = *best[*id];
    for (const TaskId next : edges[*id]) {
      Path longer = path;
      longer.tasks.push_back(next);
      longer.work += tasks.set[next].wcet;
      if (!best[next] || longer.is_larger_than(*best[next])) best[next] = std::move(longer);
    }
    if (edges[*id].empty() && *id != timer && !tasks.callbacks[*id].stores_only) paths.push_back(path);
  }
  return paths;
}

/// Names the tasks of nodes of type `callbacks`, and otherwise nodes.
Chain chain_along(const Graph& graph, const GraphTasks& tasks, const Path& path, std::size_t number) {
  Chain chain;
  chain.name = "chain_" + std::to_string(number);
  for (const TaskId id : path.tasks) {
    const Node& node = graph.nodes[tasks.origin[id].node];
    const std::string& name = node.type == NodeType::callbacks ? tasks.set[id].name : node.name;
    // A cyclic node has two tasks on the path.
    if (std::ranges::count(chain.nodes, name) == 0) chain.nodes.push_back(name);
  }
  chain.sources = {chain.nodes.front()};
  chain.sink = chain.nodes.back();
  return chain;
}

}  // namespace

std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most) {
  std::vector<std::vector<TaskId>> downstream;
  for (TaskId id = 0; id < tasks.set.size(); ++id) downstream.push_back(next_of(tasks, id));
  std::vector<Path> paths;
  for (const TaskId id : tasks.set.timers())
    for (Path& path : largest_paths(tasks, downstream, id)) paths.push_back(std::move(path));
  std::ranges::stable_sort(paths, &Path::is_larger_than);
  if (paths.size() > most) paths.resize(most);
  std::vector<Chain> chains;
  chains.reserve(paths.size());
  for (const Path& path : paths) chains.push_back(chain_along(graph, tasks, path, chains.size() + 1));
  return chains;
}

ChainLimits chain_limits(const Graph& graph, const Chain& chain) {
  const GraphTasks tasks = make_tasks(graph);
  std::vector<std::vector<TaskId>> members;
  std::vector<Duration> work;
  std::size_t sink = 0;
  for (const std::string& name : chain.nodes) {
    if (name == chain.sink) sink = members.size();
    members.push_back(tasks_named(graph, tasks, name));
    Duration& most = work.emplace_back();
    for (const TaskId id : members.back()) most = std::max(most, tasks.set[id].wcet);
  }
  const auto leads_to = [&](std::size_t from, std::size_t to) {
    return std::ranges::any_of(members[from], [&](TaskId id) {
      const std::vector<TaskId> next = tasks.downstream(id);
      return std::ranges::find_first_of(next, members[to]) != next.end();
    });
  };
  // A chain has no cycle: a node's longest branch is its own work plus that of its longest
  // predecessor.
  std::map<std::size_t, Duration> longest;
  const std::function<Duration(std::size_t)> finish = [&](std::size_t node) {
    if (const auto known = longest.find(node); known != longest.end()) return known->second;
    longest[node] = Duration::zero();  // a source's own inputs are not part of the chain
    Duration start{};
    if (std::ranges::count(chain.sources, chain.nodes[node]) == 0) {
      for (std::size_t before = 0; before < members.size(); ++before) {
        if (before != node && leads_to(before, node)) start = std::max(start, finish(before));
      }
    }
    return longest[node] = start + work[node];
  };

  return {finish(sink), std::accumulate(work.begin(), work.end(), Duration{})};
}

}  // namespace hotpath
