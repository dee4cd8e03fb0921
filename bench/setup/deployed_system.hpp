// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bounds/bounds.hpp"
#include "hotpath/analysis/deployment_bounds.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::setup {

struct CommonOptions;

/// By executor: its threads on the machine of the graph's platform; without a deployment they are of the
/// ordinary class, on all processors. Throws InputError for a processor that the machine lacks.
[[nodiscard]] std::vector<DeployedThread> threads_of(const Graph& graph, const ExecutorSpec& spec);

/// The bounds of every method for an executor or a deployment, with the threads of a simulation. Throws
/// InputError for a processor that the machine lacks.
[[nodiscard]] std::vector<GraphBounds> bounds_of(const Graph& graph, const CallbackGraph& callbacks,
                                                 const ExecutorSpec& spec);

/// What bounds, exact values and predictions rest on, each in a few words; separated by semicolons.
struct Premises {
  std::string stated;   ///< By the graph, its platform or an option.
  std::string assumed;  ///< Not measured.
};
[[nodiscard]] Premises premises(const Graph& graph, const TaskSet& set, const ExecutorSpec& spec,
                                bool phases_known);

/// What theory guarantees for any phases; std::nullopt if no method covers the system. With `options` that
/// have the same phases for all repetitions: of an executor with several threads also its exact worst cases,
/// as far as the usual limit of states allows. `refusal` gets why such an executor has no exact values, with
/// the ages that the exploration met, or, for any phases, no bounds.
[[nodiscard]] std::optional<bounds::Guarantees> guarantees(const Graph& graph, const GraphTasks& tasks,
                                                           const ExecutorSpec& spec,
                                                           const CommonOptions* options = nullptr,
                                                           std::string* refusal = nullptr);

}  // namespace hotpath::setup
