// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/deployment_bounds.hpp"

#include <algorithm>
#include <set>

#include "deployment_model.hpp"
#include "stream_paths.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

StreamedSystem streamed(const DeployedSystem& system) {
  StreamedSystem out;
  out.graph = with_joins_of_one_thread(system);
  out.thread_of = system.thread_of;
  out.wake_up = system.platform.wake_up_latency.count();
  out.delivery = system.platform.delivery_delay.count();
  std::set<unsigned> numbers;
  for (TaskId id = 0; id < out.graph.set.size(); ++id) {
    const DeployedThread& thread = system.threads[system.thread_of[id]];
    const bool pinned = thread.processors.size() == 1;
    out.bounded.push_back(thread.priority > 0);
    out.processor_of.push_back(pinned ? thread.processors.front() : StreamedSystem::kNowhere);
    if (pinned && thread.priority > 0) numbers.insert(thread.processors.front());
  }
  for (const unsigned number : numbers) {
    std::vector<bool> here;
    for (const std::uint32_t of_task : out.processor_of) here.push_back(of_task == number);
    out.processors[number] = {here, order_on(system, here), overheads_on(system, here)};
  }
  return out;
}

/// Names the executor that leaves a chain without a bound, if one does.
void explain_missing(const DeployedSystem& system, const GraphTopology& topology, GraphBounds& out) {
  for (std::size_t c = 0; c < out.chains.size(); ++c) {
    if (out.chains[c]) continue;
    std::vector<TaskId> upstream = system.graph.chains[c].sinks;
    for (std::size_t i = 0; i < upstream.size(); ++i) {
      const DeployedThread& thread = system.threads[system.thread_of[upstream[i]]];
      if (thread.priority == 0) {
        out.no_chain_bound[c] = system.graph.set[upstream[i]].name + " runs in executor " + thread.name +
                                ", whose thread is of the ordinary scheduling class";
        break;
      }
      for (const TaskId p : topology.publishers(upstream[i])) {
        if (std::ranges::find(upstream, p) == upstream.end()) upstream.push_back(p);
      }
      for (const TaskId read : system.graph.reads[upstream[i]]) {
        if (std::ranges::find(upstream, read) == upstream.end()) upstream.push_back(read);
      }
    }
  }
}

}  // namespace

GraphBounds deployment_bounds(const DeployedSystem& system) {
  constexpr const char* kMethod = "busy windows of each processor";
  if (auto refusal = refusal_of(system)) return {.method = kMethod, .refusal = std::move(refusal)};
  return attempt(kMethod, 0, [&](GraphBounds& bounds) {
    const GraphTopology topology(system.graph);
    bound_graph(topology, *stream_paths(streamed(system)), bounds);
    explain_missing(system, topology, bounds);
  });
}

}  // namespace hotpath
