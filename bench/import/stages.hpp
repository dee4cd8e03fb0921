// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/reference_system/deployment.hpp"
#include "import/delivery_orders.hpp"
#include "import/import_ctf.hpp"
#include "import/recognition.hpp"
#include "import/recorded_window.hpp"
#include "import/self_check.hpp"

namespace hotpath::imports {

/// Jobs with which executors are tried: the time of comparing orders grows with their square.
inline constexpr std::size_t kTried = 20'000;

/// A recorded system as a graph, without execution times.
struct Interpretation {
  RecordedGraph graph;  ///< With phases, chains and orders of delivery.
  RecordedTimers timers;
  std::optional<Deployment> deployment;  ///< Of the user.
  std::string deployment_file;           ///< For the recorded deployment; it is not written.
};

/// The complete graph, the recorded run, and how well a simulation under the executors matches it. How fast
/// timer threads wake up may be open: the most similar order of jobs decides.
struct Reproduction {
  std::vector<std::string> labels;   ///< By executor.
  std::vector<RecordedCosts> costs;  ///< By executor.
  TimeSlices slices;
  Graph graph;  ///< With execution times and platform.
  GraphTasks tasks;
  Trace trace;  ///< Relative to its epoch.
  setup::ExecutorSpec executor;
  SelfCheck check;
  std::vector<std::pair<std::string, double>> tried = {};  ///< Ways and similarities, if there was a choice.
};
[[nodiscard]] Reproduction reproduce(const RecordedSystem& recorded, const Interpretation& found,
                                     const std::vector<std::string>& labels);

/// All stages: each is a function of the earlier ones.
struct Imported {
  RecordedSystem recorded;
  std::vector<Recognition> recognitions;  ///< By executor.
  std::vector<bool> given;                ///< By executor: the user named it.
  RecordedDeliveries deliveries;
  Interpretation found;
  Reproduction best;
  Remarks remarks;
};
/// Writes no file, and reads none but a deployment of the user. Throws UsageError if the jobs do not suffice,
/// and the errors of the options.
[[nodiscard]] Imported import_system(RecordedSystem recorded, const CtfOptions& options);

}  // namespace hotpath::imports
