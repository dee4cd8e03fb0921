// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <iosfwd>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/tracing/ctf_trace.hpp"
#include "import/import_ctf.hpp"
#include "import/recognition.hpp"
#include "import/recorded_window.hpp"
#include "setup/executor_spec.hpp"
#include "validation/validation.hpp"

namespace hotpath::imports {

enum class Light : std::uint8_t { green, yellow, red };
constexpr auto enum_texts(Light) { return texts_in_order<Light>({"green", "yellow", "red"}); }

/// A recorded system compared with the simulation of its graph under the recorded conditions.
struct SelfCheck {
  struct ChainCheck {
    std::string chain;
    Quantiles recorded_ms, simulated_ms;
    double median_error_percent = kNoValue, p99_error_percent = kNoValue;  ///< Simulated to recorded.
    /// The medians differ, but each is among the outputs around the other.
    bool between_modes = false;
  };
  validation::ScheduleComparison schedule;
  std::vector<ChainCheck> chains;
  /// Skipped or overwritten timestamps and samples, of all tasks together.
  double lost_recorded_percent = 0, lost_simulated_percent = 0;
  Light light = Light::green;
  std::vector<std::string> reasons;  ///< Sentences that explain why the light is not green.
  Trace simulated;
  std::string failure;  ///< Why there is no simulation; empty: there is one.

  /// The reproduction is not green.
  void doubt(std::string reason, Light is = Light::yellow) {
    light = std::max(light, is);
    reasons.push_back(std::move(reason));
  }
};

HOTPATH_FIELDS(SelfCheck::ChainCheck, chain, recorded_ms, simulated_ms, median_error_percent,
               p99_error_percent, between_modes);

/// Limits of green: the bar for a good prediction.
inline constexpr double kMedianError_percent = 3, kP99Error_percent = 8, kLossError_points = 1,
                        kSimilarity = 0.8;

/// `recorded` is relative to its epoch and `tasks` have its phases. The simulation begins with the recorded
/// executors; jobs and outputs whose timestamp lies before the epoch do not count. `doubted`: by chain, why
/// it cannot be compared.
[[nodiscard]] SelfCheck self_check(const Graph& graph, const GraphTasks& tasks,
                                   const setup::ExecutorSpec& executor, const Trace& recorded,
                                   const std::map<std::string, std::string>& doubted = {});

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

/// All stages: each is a function of the earlier ones. The caller sets what is of the whole trace.
struct Imported {
  RecordedSystem recorded;
  std::vector<Recognition> recognitions;  ///< By executor.
  std::vector<bool> given;                ///< By executor: the user named it.
  RecordedDeliveries deliveries;
  Interpretation found;
  Reproduction best;
  Remarks remarks;
  CtfOptions options = {};
  tracing::System system = {};         ///< Of the whole trace.
  tracing::TraceReading reading = {};  ///< The same.
  std::uint64_t later_jobs = 0;        ///< Jobs after those used for rules and times.

  [[nodiscard]] std::uint64_t jobs() const { return recorded.jobs.size() + later_jobs; }
};
/// Writes no file, and reads none but a deployment of the user. Throws UsageError if the jobs do not suffice,
/// and the errors of the options.
[[nodiscard]] Imported import_system(RecordedSystem recorded, const CtfOptions& options);

/// The comments of graph.yaml.
[[nodiscard]] GraphComments import_comments(const Imported& imported);
/// The content of import.json; keys end with their units.
[[nodiscard]] nlohmann::json import_json(const Imported& imported);

/// Prints the summary of the import.
void print_import(std::ostream& out, const Imported& imported);

}  // namespace hotpath::imports
