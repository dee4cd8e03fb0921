// SPDX-License-Identifier: Apache-2.0
#include "bounds/guarantees.hpp"

#include <algorithm>

#include "bounds/bounds.hpp"
#include "hotpath/analysis/analysis_error.hpp"

namespace hotpath::bounds {

namespace {

void keep_smaller(std::optional<Guarantee>& kept, std::optional<std::int64_t> bound,
                  const std::string& method) {
  if (bound && (!kept || *bound < kept->ns)) kept = {*bound, method};
}

}  // namespace

const ChainGuarantee* Guarantees::chain(const std::string& name) const {
  const auto chain = std::ranges::find(chains, name, &ChainGuarantee::name);
  return chain == chains.end() ? nullptr : &*chain;
}

std::optional<Guarantees> guarantees(const Graph& graph, const GraphTasks& tasks,
                                     const ExecutorEntry& executor, const SchedulerOptions& options) try {
  const CallbackGraph callbacks = callback_graph(graph, tasks, false);
  Guarantees all;
  all.tasks.resize(tasks.set.size());
  for (const CallbackGraph::DataChain& chain : callbacks.chains) all.chains.push_back({chain.name, {}, {}});
  bool covered = false;
  for (const GraphBounds& bounds : graph_bounds(bounded_system(graph, callbacks, executor, options))) {
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
} catch (const AnalysisError&) {
  return std::nullopt;  // no method covers the rules by which some node publishes
}

}  // namespace hotpath::bounds
