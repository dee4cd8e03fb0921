// SPDX-License-Identifier: Apache-2.0
#include "bounds/bounds.hpp"

#include <algorithm>

#include "hotpath/reference_system/phases.hpp"

namespace hotpath::bounds {

namespace {

[[noreturn]] void fail(const GraphTasks& tasks, TaskId id, const std::string& behaviour) {
  throw AnalysisError("no method covers callback " + tasks.set[id].name + ", which " + behaviour);
}

/// The tasks of the inputs of a task's node.
std::vector<TaskId> tasks_of(const GraphTasks& tasks, TaskId id, const std::vector<std::uint32_t>& inputs) {
  std::vector<TaskId> all;
  for (const std::uint32_t input : inputs) {
    TaskId of_input = id - tasks.origin[id].callback;  // the node's first one
    while (tasks.origin[of_input].input != input) ++of_input;
    all.push_back(of_input);
  }
  return all;
}

void add_to_join(const GraphTasks& tasks, TaskId id, CallbackGraph& out) {
  const std::vector<Publication>& publishes = tasks.callbacks[id].publishes;
  const std::vector<TaskId> inputs = tasks_of(tasks, id, publishes.front().of);
  if (std::ranges::count(inputs, id) == 0) fail(tasks, id, "completes a set without its sample");
  for (const TaskId other : inputs) {
    if (tasks.callbacks[other].publishes != publishes)
      fail(tasks, id, "waits for a set with " + tasks.set[other].name + ", but publishes other topics");
  }
  for (const Publication& p : publishes) {
    if (p.of != publishes.front().of) fail(tasks, id, "waits for several sets");
  }
  if (id == inputs.front()) out.joins.push_back({.inputs = inputs});
}

void add_publications(const GraphTasks& tasks, TaskId id, CallbackGraph& out) {
  const Callback& callback = tasks.callbacks[id];
  std::vector<TaskId>& reads = out.reads.emplace_back();
  out.every.push_back(1);
  if (callback.publishes_early()) fail(tasks, id, "publishes before the end of its jobs");
  if (callback.waits_for_sets()) return add_to_join(tasks, id, out);
  for (const Publication& p : callback.publishes) {
    if (p.rule == PublishRule::all_new)
      fail(tasks, id, "publishes some topics with every job and others when a set is complete");
    out.every.back() = std::max(out.every.back(), p.n);
    const std::vector<TaskId> read = tasks_of(tasks, id, p.of);
    reads.insert(reads.end(), read.begin(), read.end());
  }
}

}  // namespace

std::vector<BoundedChain> bounded_chains(const Graph& graph, const GraphTasks& tasks) {
  const auto is_timer = [&](TaskId id) { return tasks.set[id].kind == TaskKind::timer; };
  std::vector<BoundedChain> all;
  std::uint32_t number = 0;
  for (ChainIndex& chain : index_chains(graph, tasks)) {
    if (std::ranges::all_of(chain.sources, is_timer)) all.push_back({std::move(chain), number});
    ++number;
  }
  return all;
}

CallbackGraph callback_graph(const Graph& graph, const GraphTasks& tasks, bool phases_known) {
  CallbackGraph out;
  out.set = tasks.set;
  out.phases_known = phases_known;
  out.creation_spread = std::ranges::max(creation_instants(graph, tasks, std::nullopt));
  out.delivery_known = unknown_deliveries(graph).empty();
  for (TaskId id = 0; id < tasks.set.size(); ++id) add_publications(tasks, id, out);
  for (const BoundedChain& chain : bounded_chains(graph, tasks))
    out.chains.push_back({graph.chains[chain.number].name, chain.sources, chain.sink_tasks});
  return out;
}

std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                      const std::vector<GraphBounds>& all_bounds) {
  std::optional<Guarantees> all;
  for (const GraphBounds& bounds : all_bounds) {
    if (bounds.refusal) continue;
    if (!all) all.emplace();
    const auto keep = [&](Latency latency, const std::string& name, std::optional<std::int64_t> bound) {
      const auto kept = all->of(latency, name);
      if (bound && (!kept || *bound < kept->ns)) (*all)[{latency, name}] = {*bound, bounds.method};
    };
    for (TaskId id = 0; id < bounds.tasks.size(); ++id)
      keep(Latency::response, callbacks.set[id].name, bounds.tasks[id]);
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      if (!bounds.chains[c]) continue;
      keep(Latency::age, callbacks.chains[c].name, bounds.chains[c]->latency);
      keep(Latency::hot_path, callbacks.chains[c].name, bounds.chains[c]->hot_path);
    }
  }
  return all;
}

}  // namespace hotpath::bounds
