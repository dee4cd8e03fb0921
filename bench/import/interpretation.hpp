// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "import/delivery_orders.hpp"
#include "import/import_ctf.hpp"
#include "import/recorded_trace.hpp"
#include "import/recorded_window.hpp"
#include "import/self_check.hpp"

namespace hotpath::imports {

/// The jobs of a recording, and what does not depend on its executors.
struct Recording {
  const tracing::System& system;
  std::vector<tracing::Job> jobs;  ///< Of all callbacks, by start.
  std::vector<tracing::LostSample> lost;
  std::string deployment_file;  ///< For the recorded deployment, if there are several executors.
  // Set by interpret():
  RecordedExecutors executors = {};
  RecordedDeliveries deliveries = {};
  RecordedGraph graph = {};  ///< With phases, chains and orders of delivery.
  RecordedTimers timers = {};
  Time end{};  ///< In the trace's time.
  unsigned cores = 1;
  std::optional<Deployment> deployment = {};  ///< Of the user.
};

/// A recording interpreted under certain executors: timestamps of timers, costs, and how well a
/// simulation matches.
struct Interpretation {
  std::vector<std::string> labels;  ///< By executor.
  std::unique_ptr<RecordedTrace> rows;
  std::vector<JobRecord> records;    ///< Parallel to the recording's jobs; in the trace's time.
  std::vector<RecordedCosts> costs;  ///< By executor.
  Precedence precedence;
  Graph graph;  ///< With execution times and platform.
  GraphTasks tasks;
  Trace trace;  ///< Relative to its epoch.
  std::optional<setup::ExecutorSpec> executor;
  SelfCheck check;
};

/// The tried interpretations, and the one with the most similar order of jobs.
struct Interpretations {
  Interpretation best;
  std::vector<std::pair<std::string, double>> tried;  ///< Labels and similarities, if there was a choice.
};

/// Learns executors, graph, timers and chains from the jobs, in any order, and tries the executors
/// that may have run them. Writes no file, and reads none but a deployment of the user. Throws
/// UsageError if the jobs do not suffice, and the errors of the options.
[[nodiscard]] Interpretations interpret(Recording& recording, const CtfOptions& options);

}  // namespace hotpath::imports
