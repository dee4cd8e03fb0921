// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>

#include "import/chain_follower.hpp"
#include "import/recorded_window.hpp"

namespace hotpath::imports {

namespace {

/// What enters the messages of a node, by the inferred rules.
std::vector<HeldInputs> held_inputs(const RecordedGraph& graph) {
  const auto tasks_of = [&](const std::vector<std::uint32_t>& callbacks) {
    std::vector<TaskId> tasks;
    tasks.reserve(callbacks.size());
    for (const std::uint32_t callback : callbacks) tasks.push_back(graph.task({callback, 0}));
    return tasks;
  };
  std::vector<HeldInputs> held;
  for (const InferredRule& rule : graph.rules)
    held.push_back({rule.topic, tasks_of(rule.publishers), tasks_of(rule.of)});
  return held;
}

std::vector<std::size_t> most_unread(const tracing::System& system) {
  std::vector<std::size_t> unread(system.topics.size(), 0);
  for (const tracing::Callback& reader : system.callbacks) {  // also services and clients
    if (reader.topic >= unread.size()) continue;
    unread[reader.topic] = std::max(unread[reader.topic], ChainFollower::most_unread(reader.depth));
  }
  return unread;
}

}  // namespace

std::vector<ChainObservation> recorded_chains(const tracing::System& system, const RecordedGraph& graph,
                                              const RecordedWindow& window) {
  std::vector<ChainObservation> observations;
  std::vector<bool> publishing;
  for (const Callback& callback : graph.tasks.callbacks) publishing.push_back(!callback.publishes.empty());
  ChainFollower follower(index_chains(graph.graph, graph.tasks), held_inputs(graph), most_unread(system),
                         std::move(publishing), ChainLanes(graph.graph, graph.tasks),
                         [&](const ChainObservation& o) { observations.push_back(o); });
  // What to do at which event of the trace, in its order.
  std::vector<std::pair<std::uint64_t, std::function<void()>>> steps;
  for (std::size_t i = 0; i < window.jobs.size(); ++i) {
    const tracing::Job& job = window.jobs[i];
    if (graph.task(job.ref) == kNoTask) continue;
    steps.emplace_back(job.started, [&, i] {
      std::optional<ChainFollower::Taken> taken;
      if (job.has_sample)
        taken = {job.sample.parent, graph.task(job.sample.parent), system.callbacks[job.ref.callback].topic};
      follower.start(job.ref, window.records[i].job.ref(), job.start, taken);
    });
    for (const tracing::Publication& p : job.published)
      steps.emplace_back(p.event, [&] { follower.publish(job.ref, p.topic); });
    if (job.ended) steps.emplace_back(job.finished, [&] { follower.end(job.ref, true); });
  }
  std::ranges::stable_sort(steps, {}, [](const auto& step) { return step.first; });
  for (const auto& [event, step] : steps) step();
  return observations;
}

}  // namespace hotpath::imports
