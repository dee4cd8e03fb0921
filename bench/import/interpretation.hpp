// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "import/delivery_orders.hpp"
#include "import/import_ctf.hpp"
#include "import/recognition.hpp"
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
  std::vector<Recognition> recognitions = {};  ///< By executor.
  std::string given = {};                      ///< The executor that the user named, or empty.
  RecordedGraph first_graph = {};              ///< In the order of creation, as recognition sees it.
  RecordedGraph graph = {};                    ///< With phases, chains and orders of delivery.
  RecordedTimers timers = {};
  Time end{};  ///< In the trace's time.
  unsigned cores = 1;
  std::optional<Deployment> deployment = {};  ///< Of the user.
};

/// The thread that releases timers, beside the one that runs the other callbacks.
enum class ThreadPriorities : std::uint8_t {
  by_executor,
  raised,      ///< The timer thread preempts.
  equal_fifo,  ///< Both have one priority of SCHED_FIFO: the timer thread waits until the other sleeps.
};

/// A recording interpreted under certain executors: timestamps of timers, costs, and how well a
/// simulation matches.
struct Interpretation {
  std::vector<std::string> labels;  ///< By executor.
  ThreadPriorities priorities = ThreadPriorities::by_executor;
  std::unique_ptr<RecordedTrace> rows;
  std::vector<JobRecord> records;    ///< Parallel to the recording's jobs; in the trace's time.
  std::vector<RecordedCosts> costs;  ///< By executor.
  Graph graph;                       ///< With execution times and platform.
  GraphTasks tasks;
  Trace trace;  ///< Relative to its epoch.
  std::optional<setup::ExecutorSpec> executor;
  SelfCheck check;
  TimeSlices slices;
};

/// The interpretation under the recognised or given executors. Where these do not decide how fast
/// timer threads wake up, each way was tried, and the most similar order of jobs decided.
struct Interpretations {
  Interpretation best;
  std::vector<std::pair<std::string, double>> tried;  ///< Ways and similarities, if there was a choice.
};

/// Learns graph, timers and chains from the jobs, in any order, recognises the executors, and
/// simulates the graph under them. Writes no file, and reads none but a deployment of the user. Throws
/// UsageError if the jobs do not suffice, and the errors of the options.
[[nodiscard]] Interpretations interpret(Recording& recording, const CtfOptions& options);

}  // namespace hotpath::imports
