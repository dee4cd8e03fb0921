// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "machine/machine.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::setup {

/// What a graph asks of threads, callback groups and cores, and what follows from it.
struct Utilisation {
  double percent = 0;                   ///< Of the threads, callback group or cores that have least room.
  unsigned threads = 0;                 ///< Threads that run jobs.
  std::optional<std::string> overload;  ///< Why the system cannot keep up; none: it can.
  std::vector<std::string> warnings;    ///< Whole sentences, the overload among them.
};

/// The machine of a live run, and the policies of single executors, unless they are the default.
struct LiveThreads {
  const machine::Machine& machine;
  std::optional<ThreadPolicy> executor, timers;
};

/// Of an executor or a deployment, or of the graph alone if `spec` is nullptr, on the cores of the graph's
/// platform, with the mean execution times of its model. Without `live`, the kernel's rule for real-time
/// threads is a condition.
[[nodiscard]] Utilisation utilisation(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec* spec,
                                      const LiveThreads* live = nullptr);

/// By task: the share of samples that a reader of depth 1 leaves out under every executor, since its work is
/// more than one thread can do; in [0, 1).
[[nodiscard]] std::vector<double> intended_losses(const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath::setup
