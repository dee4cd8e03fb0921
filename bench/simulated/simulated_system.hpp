// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hotpath/core/simulator.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::simulated {

/// The executors of one simulation of a graph, with the same threads as in a live run.
class System {
 public:
  /// Throws UsageError, or InputError with the line of the deployment, if the simulated machine
  /// lacks a processor or a policy.
  System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks);

  [[nodiscard]] std::span<const SimulatedExecutor> executors() const { return executors_; }
  /// By task.
  [[nodiscard]] const std::vector<std::uint32_t>& executor_of() const { return executor_of_; }

 private:
  std::vector<std::unique_ptr<Scheduler>> schedulers_;
  std::vector<SimulatedExecutor> executors_;
  std::vector<std::uint32_t> executor_of_;
};

}  // namespace hotpath::simulated
