// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "import/recorded_executors.hpp"
#include "import/recorded_trace.hpp"
#include "import/self_check.hpp"

namespace hotpath {

/// The parts of a recording that do not depend on the executors.
struct Recording {
  const RecordedSystem& system;
  RecordedGraph graph;  ///< With phases and chains.
  RecordedTimers timers;
  RecordedExecutors executors;
  std::vector<RecordedJob> jobs;  ///< Of all callbacks, by start.
  struct Lost {
    std::uint32_t subscription;
    RecordedSample sample;
    bool queued;
  };
  std::vector<Lost> lost;
  Time end{};  ///< In the trace's time.
  unsigned cores = 1;
  std::string deployment;  ///< File of the user; empty: none.
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
  Trace trace;                  ///< Relative to its epoch.
  std::string deployment_yaml;  ///< Empty: one executor.
  std::optional<ExecutorSpec> executor;
  SelfCheck check;
};

/// `folder`: for a deployment file. `timer_thread`: the priority of timer management threads, which
/// no trace records. Throws the errors of reading a given deployment.
[[nodiscard]] Interpretation interpret(const Recording& recording, const std::vector<std::string>& labels,
                                       TimerThread timer_thread, const std::filesystem::path& folder,
                                       Duration warm_up);

/// The tried interpretations, and the one with the most similar order of jobs.
struct Interpretations {
  Interpretation best;
  std::vector<std::pair<std::string, double>> tried;  ///< Labels and similarities, if there was a choice.
};
[[nodiscard]] Interpretations best_interpretation(const Recording& recording,
                                                  const std::filesystem::path& folder, Duration warm_up);

}  // namespace hotpath
