// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::explain {

/// The command line of `hotpath explain`.
struct Options {
  std::string run;
  std::string other;                        ///< A second run, to compare.
  std::vector<std::string> executors;       ///< At most two; empty: the first of the run.
  std::optional<std::uint32_t> repetition;  ///< std::nullopt: all.
  std::string chain;                        ///< Empty: the first of the graph.
  std::string task;                         ///< Response times of this task in place of a chain.
  bool hot_path = false;  ///< A chain's hot-path latencies in place of the ages of its data.
  bool worst = false;
  std::optional<double> quantile;  ///< In [0, 1].
  std::optional<std::uint64_t> sequence;
  bool json = false;  ///< Instead of text.
};

/// Explains one output, many outputs, or the difference of two executors. Reads jobs.csv row by row;
/// memory grows with the number of outputs and with the jobs that overlap the longest latency.
/// Throws UsageError and InputError.
void explain(const Options& options);

/// A simulation with the records of its jobs and chains.
struct SimulatedRun {
  std::string name;
  const setup::ExecutorSpec& executor;
  const Graph& graph;
  const GraphTasks& tasks;
  const ExecutionTimes& times;
  const Trace& trace;
};
/// Why one is faster than the other along a chain of the graph, by the age of the data or the hot-path
/// latency: up to three sentences. Both have the same tasks, phases and execution times.
[[nodiscard]] std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b,
                                                  std::uint32_t chain, Latency latency);

}  // namespace hotpath::explain
