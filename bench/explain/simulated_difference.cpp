// SPDX-License-Identifier: Apache-2.0
#include "explain/simulated_difference.hpp"

#include <algorithm>
#include <utility>

#include "explain/explain_report.hpp"

namespace hotpath::explain {

namespace {

ComparedOutputs compared(const SimulatedRun& run, std::uint32_t chain) {
  const System system(run.executor, run.graph, run.tasks, results::RunKind::simulated,
                      run.graph.platform.cores);
  std::vector<Output> outputs;
  for (const ChainRecord& record : run.trace.chains) {
    if (record.chain == chain && record.hot_path_latency >= Duration{})
      outputs.push_back({0, record.sequence, record.hot_path_latency, record.sink});
  }
  ComparedOutputs explained;
  Explainer explainer(system, {chain, kNoTask}, std::move(outputs), run.name,
                      [&](const Explanation& explanation) { explained.add(explanation); });
  explainer.begin(0, &run.times);
  for (const JobRecord& record : run.trace.jobs) explainer.add(record);
  explainer.end();
  return explained;
}

}  // namespace

std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b, std::uint32_t chain) {
  ComparedOutputs of_a = compared(a, chain), of_b = compared(b, chain);
  if (of_a.outputs.empty() || of_b.outputs.empty()) return {};
  const std::string& name = a.graph.chains[chain].name;
  return sentences({a.tasks.set, a.name, name, "", 0}, {b.tasks.set, b.name, name, "", 0},
                   compare(std::move(of_a), std::move(of_b), true));
}

}  // namespace hotpath::explain
