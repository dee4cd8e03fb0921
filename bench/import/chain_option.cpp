// SPDX-License-Identifier: Apache-2.0
#include "import/chain_option.hpp"

#include <algorithm>
#include <sstream>
#include <utility>
#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// The task that a name on the command line means: a task, or a node's timer or only callback.
TaskId named_task(const Graph& graph, const GraphTasks& tasks, const std::string& name, bool timer) {
  std::vector<TaskId> named = tasks_named(graph, tasks, name);
  if (named.size() > 1)
    std::erase_if(named, [&](TaskId id) { return (tasks.set[id].kind == TaskKind::timer) != timer; });
  if (named.size() == 1) return named.front();
  throw program::UsageError(program::concat(
      "--chain: ", name,
      named.empty() ? " is not a node or task of the graph" : " has several such callbacks; name one",
      "; the tasks are in graph.yaml, for example ", tasks.set[0].name));
}

}  // namespace

Chain chain_of(const std::string& text, const Graph& graph, const GraphTasks& tasks) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos) throw program::UsageError("--chain: `" + text + "` is not SOURCE,...:SINK");
  Chain chain;
  chain.name = text.substr(colon + 1);
  const TaskId sink = named_task(graph, tasks, chain.name, false);
  std::vector<bool> reaches(tasks.set.size(), false), reached(tasks.set.size(), false);
  reaches[sink] = true;
  for (bool changed = true; std::exchange(changed, false);) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const auto next = tasks.downstream(id);
      if (reaches[id] || std::ranges::none_of(next, [&](TaskId n) { return reaches[n]; })) continue;
      reaches[id] = changed = true;
    }
  }
  std::vector<TaskId> open;
  std::istringstream names(text.substr(0, colon));
  for (std::string name; std::getline(names, name, ',');) {
    const TaskId source = named_task(graph, tasks, name, true);
    if (tasks.set[source].kind != TaskKind::timer)
      throw program::UsageError("--chain: " + name + " is not a timer, and chains begin at timers");
    if (!reaches[source])
      throw program::UsageError("--chain: no data flows from " + name + " to " + chain.name);
    chain.sources.push_back(tasks.set[source].name);
    open.push_back(source);
  }
  while (!open.empty()) {
    const TaskId id = open.back();
    open.pop_back();
    if (reached[id] || !reaches[id]) continue;
    reached[id] = true;
    const std::vector<TaskId> next = id == sink ? std::vector<TaskId>() : tasks.downstream(id);
    open.insert(open.end(), next.begin(), next.end());
  }
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    if (reached[id]) chain.nodes.push_back(tasks.set[id].name);
  chain.sink = tasks.set[sink].name;
  return chain;
}

}  // namespace hotpath::imports
