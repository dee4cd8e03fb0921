// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
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

// An import is a chain of stages, each a function of the earlier ones: recorded_system(), interpret(),
// recognise_executors(), choose_executors(), interpret() in the order that these show, reproduce().
namespace hotpath::imports {

/// Jobs with which executors are tried: the time of comparing orders grows with their square.
inline constexpr std::size_t kTried = 20'000;

/// A recorded system as a graph, without execution times.
struct Interpretation {
  RecordedGraph graph;  ///< With phases, chains and orders of delivery.
  RecordedTimers timers;
  std::optional<Deployment> deployment;  ///< Of the user.
};
using Priorities = std::map<std::uint32_t, std::int64_t>;  ///< Of timers, by callback.
/// What recognised executors show of a graph; by default it has the order of creation.
struct Shown {
  ServiceOrder order = {};
  Priorities priorities = {};
  bool other = false;  ///< The second reading of what is undecided.
};
/// Throws UsageError if the jobs do not suffice, and the errors of the options.
[[nodiscard]] Interpretation interpret(const RecordedSystem& recorded, const CtfOptions& options,
                                       const RecordedDeliveries& deliveries, const Shown& shown = {});

/// Compares the possible executors of each group of threads with its decisions, unless one describes itself.
[[nodiscard]] std::vector<Recognition> recognise_executors(const RecordedSystem& recorded,
                                                           const Interpretation& found);

/// The executors under which a recording is reproduced, and what their fits say.
struct ChosenExecutors {
  std::vector<std::string> labels;  ///< By executor.
  OrderEvidence order;
  Priorities priorities;
};
/// `given`: the executor that the user named, or empty. `graph`: that of the recognitions.
[[nodiscard]] ChosenExecutors choose_executors(const std::vector<Recognition>& recognitions,
                                               const RecordedGraph& graph, const std::string& given);

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
/// `deployment_file`: for the recorded deployment, if there is one; it is not written.
[[nodiscard]] Reproduction reproduce(const RecordedSystem& recorded, const Interpretation& found,
                                     const std::vector<std::string>& labels,
                                     const std::string& deployment_file);

/// All stages.
struct Imported {
  RecordedSystem recorded;
  std::vector<Recognition> recognitions;  ///< By executor.
  RecordedDeliveries deliveries;
  Interpretation found;
  Reproduction best;
  std::vector<std::string> notes;      ///< Sentences about differences between the graph and the system.
  std::vector<std::string> uncertain;  ///< Phrases.
};
/// Writes no file, and reads none but a deployment of the user. Throws as interpret().
[[nodiscard]] Imported import_system(RecordedSystem recorded, const CtfOptions& options);

}  // namespace hotpath::imports
