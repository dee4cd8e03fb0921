// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "random_graphs.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::test {

/// First timestamps of the timers: random, all at once, or by creation.
void draw_phases(Random& random, const Graph& graph, GraphTasks& tasks);

/// A random order for each topic of several subscribers.
void draw_deliveries(Random& random, Graph& graph);

/// A random graph, some with release jitter or services; samples reach subscribers in the order of creation,
/// in a given one, or, if `any_delivery`, in an unknown one.
Graph draw_graph(Random& random, std::uint64_t seed, bool any_delivery);

/// Two to six timers, each followed by up to three subscriptions, for two or three threads with a core each.
Graph draw_lines(Random& random);

/// A few executors, to which nodes or tasks belong at random, each with a priority and a processor, or of the
/// ordinary scheduling class. Priorities may be equal; the machine has those costs that the method covers.
setup::ExecutorSpec random_deployment(Random& random, Graph& graph, GraphTasks& tasks);

/// A run of the system; std::nullopt if its machine is overloaded.
std::optional<Trace> simulated(const Graph& graph, const GraphTasks& given,
                               const setup::ExecutorSpec& executor, const ExecutionTimes& times,
                               Duration duration, std::vector<ChainObservation>* observations);

/// Where the tasks run, for the report of a counter-example.
std::string deployment_text(const setup::ExecutorSpec& executor, const TaskSet& set);

}  // namespace hotpath::test
