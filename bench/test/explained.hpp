// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "explain/explainer.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "setup/run_setup.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::explain {

/// A simulation whose outputs can be explained. Throws SimulationError.
class Simulated {
 public:
  Simulated(Graph graph, const setup::ExecutorSpec& spec, Phases phases, Duration length,
            std::uint64_t seed = 1)
      : graph_(std::move(graph)), tasks_(make_tasks(graph_)) {
    setup::set_phases(tasks_.set, make_phases(graph_, tasks_, phases, {.step = {}, .seed = seed}));
    times_ = simulated::execution_times_of(graph_, tasks_, seed);
    simulated::Plan plan{spec, graph_, tasks_, *times_};
    plan.duration = length;
    trace_ = simulated::simulate_repetition(plan).trace;
    system_.emplace(spec, graph_, tasks_, results::RunKind::simulated, graph_.platform.cores);
  }
  Simulated(const Simulated&) = delete;
  Simulated& operator=(const Simulated&) = delete;

  const GraphTasks& tasks() const { return tasks_; }
  const Graph& graph() const { return graph_; }
  const Trace& trace() const { return trace_; }
  const System& system() const { return *system_; }

  std::vector<Explanation> explained(std::optional<std::uint32_t> chain, const std::vector<Output>& outputs,
                                     Latency latency = Latency::response) const {
    std::vector<Explanation> all;
    Explainer explainer(system(), chain, latency, outputs, times_.get(),
                        [&](const Explanation& e) { all.push_back(e); });
    for (const JobRecord& r : trace_.jobs) explainer.add(r);
    explainer.end();
    EXPECT_EQ(all.size(), outputs.size());
    return all;
  }

 private:
  const Graph graph_;
  GraphTasks tasks_;
  std::unique_ptr<ExecutionTimes> times_;
  Trace trace_;
  std::optional<System> system_;
};

}  // namespace hotpath::explain
