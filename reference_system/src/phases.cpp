// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/phases.hpp"

#include <limits>
#include <random>
#include <stdexcept>

namespace hotpath {

namespace {

/// Uniform in [0, bound), with the same result on every platform, unlike
/// std::uniform_int_distribution.
std::uint64_t uniform(std::mt19937_64& generator, std::uint64_t bound) {
  const std::uint64_t limit = std::numeric_limits<std::uint64_t>::max() / bound * bound;
  std::uint64_t drawn = generator();
  while (drawn >= limit) drawn = generator();
  return drawn % bound;
}

}  // namespace

std::vector<Duration> creation_instants(const Graph& graph, const GraphTasks& tasks,
                                        std::optional<Duration> step) {
  std::vector<Duration> finished;  // end of each node's creation
  Duration now{};
  for (const Node& node : graph.nodes) {
    const auto endpoints = static_cast<std::int64_t>(node.inputs.size() + node.outputs.size());
    now += step.value_or(kNodeCreation + endpoints * kEndpointCreation);
    finished.push_back(now);
  }
  std::vector<Duration> instants(tasks.set.size());
  std::optional<Duration> first;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].kind != TaskKind::timer) continue;
    const Duration instant = finished[tasks.origin[id].node];
    if (!first) first = instant;
    instants[id] = instant - *first;
  }
  return instants;
}

std::vector<Duration> make_phases(const Graph& graph, const GraphTasks& tasks, Phases phases,
                                  const PhaseOptions& options) {
  std::vector<Duration> first(tasks.set.size());
  if (phases == Phases::creation) first = creation_instants(graph, tasks, options.step);
  std::mt19937_64 generator(options.seed);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const Task& task = tasks.set[id];
    if (task.kind != TaskKind::timer) continue;
    switch (phases) {
      case Phases::creation:
        first[id] += task.period;
        break;
      case Phases::synchronous:
        break;
      case Phases::given:
        if (!tasks.callbacks[id].phase) {
          throw std::invalid_argument("graph " + graph.name + " gives no phase for the timer " + task.name +
                                      "; add `phase_ms` to it, or give a file of phases");
        }
        first[id] = *tasks.callbacks[id].phase;
        break;
      case Phases::random:
        first[id] = Duration(uniform(generator, static_cast<std::uint64_t>(task.period.count())));
        break;
    }
  }
  return first;
}

}  // namespace hotpath
