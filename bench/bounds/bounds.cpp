// SPDX-License-Identifier: Apache-2.0
#include "bounds/bounds.hpp"

#include <algorithm>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath::bounds {

namespace {

bool is_all_new(const Publication& p) { return p.rule == PublishRule::all_new; }

class Mapping {
 public:
  explicit Mapping(const GraphTasks& tasks) : tasks_(tasks) {}

  void add_publications(TaskId id, CallbackGraph& out) {
    const Callback& callback = tasks_.callbacks[id];
    out.reads.emplace_back();
    out.every.push_back(1);
    if (callback.publishes_early()) fail(id, "publishes before the end of its jobs");
    if (callback.waits_for_sets()) return add_to_join(id, out);
    for (const Publication& p : callback.publishes) {
      if (is_all_new(p)) fail(id, "publishes some topics with every job and others when a set is complete");
      out.every.back() = std::max(out.every.back(), p.n);
      for (const std::uint32_t input : p.of) out.reads.back().push_back(task_of(id, input));
    }
  }

 private:
  [[noreturn]] void fail(TaskId id, const std::string& behaviour) const {
    throw AnalysisError("no method covers callback " + tasks_.set[id].name + ", which " + behaviour);
  }

  TaskId first_of_node(TaskId id) const { return id - tasks_.origin[id].callback; }

  TaskId task_of(TaskId id, std::uint32_t input) const {
    TaskId t = first_of_node(id);
    while (tasks_.origin[t].input != input) ++t;
    return t;
  }

  void add_to_join(TaskId id, CallbackGraph& out) {
    const Callback& callback = tasks_.callbacks[id];
    CallbackGraph::Join join;
    for (const std::uint32_t input : callback.publishes.front().of) join.inputs.push_back(task_of(id, input));
    if (std::ranges::find(join.inputs, id) == join.inputs.end())
      fail(id, "completes a set without its sample");
    for (const TaskId other : join.inputs) {
      if (tasks_.callbacks[other].publishes != callback.publishes) {
        fail(id, "waits for a set with " + tasks_.set[other].name + ", but publishes other topics");
      }
    }
    for (const Publication& p : callback.publishes) {
      if (p.of != callback.publishes.front().of) fail(id, "waits for several sets");
    }
    if (id == join.inputs.front()) out.joins.push_back(std::move(join));
  }

  const GraphTasks& tasks_;
};

void keep_smaller(std::optional<Guarantee>& kept, std::optional<std::int64_t> bound,
                  const std::string& method) {
  if (bound && (!kept || *bound < kept->ns)) kept = {*bound, method};
}

}  // namespace

CallbackGraph callback_graph(const Graph& graph, const GraphTasks& tasks, bool phases_known) {
  CallbackGraph out;
  out.set = tasks.set;
  out.phases_known = phases_known;
  out.creation_spread = std::ranges::max(creation_instants(graph, tasks, std::nullopt));
  out.delivery_known = unknown_deliveries(graph).empty();
  Mapping mapping(tasks);
  for (TaskId id = 0; id < tasks.set.size(); ++id) mapping.add_publications(id, out);
  const std::vector<ChainIndex> chains = index_chains(graph, tasks);
  const auto is_timer = [&](TaskId id) { return tasks.set[id].kind == TaskKind::timer; };
  for (std::size_t c = 0; c < chains.size(); ++c) {
    if (!std::ranges::all_of(chains[c].sources, is_timer)) continue;  // begins inside other chains
    out.chains.push_back({graph.chains[c].name, chains[c].sources, chains[c].sink_tasks});
  }
  return out;
}

BoundedSystem bounded_system(const Graph& graph, const CallbackGraph& callbacks,
                             const ExecutorEntry& executor, const SchedulerOptions& options) {
  return {callbacks, executor, options, make_platform(graph, executor)};
}

const ChainGuarantee* Guarantees::chain(const std::string& name) const {
  const auto chain = std::ranges::find(chains, name, &ChainGuarantee::name);
  return chain == chains.end() ? nullptr : &*chain;
}

std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                      const std::vector<GraphBounds>& all_bounds) {
  Guarantees all;
  all.tasks.resize(callbacks.set.size());
  for (const CallbackGraph::DataChain& chain : callbacks.chains) all.chains.push_back({chain.name, {}, {}});
  bool covered = false;
  for (const GraphBounds& bounds : all_bounds) {
    covered = covered || bounds.refusal.empty();
    for (std::size_t t = 0; t < bounds.tasks.size(); ++t) {
      keep_smaller(all.tasks[t], bounds.tasks[t], bounds.method);
    }
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      if (!bounds.chains[c]) continue;
      keep_smaller(all.chains[c].age, bounds.chains[c]->latency, bounds.method);
      keep_smaller(all.chains[c].hot_path, bounds.chains[c]->hot_path, bounds.method);
    }
  }
  return covered ? std::optional(std::move(all)) : std::nullopt;
}

}  // namespace hotpath::bounds
