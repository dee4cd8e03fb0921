// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "bounds/bounds.hpp"
#include "program/table.hpp"
#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::guarantees {

/// A bound of one method, beside the worst observation of a run, if there is one. In nanoseconds.
struct BoundRow {
  std::string executor{}, method{};
  Latency latency = Latency::response;
  std::string name{};  ///< Of the task or chain.
  std::optional<std::int64_t> bound_ns{}, observed_ns{};
  std::optional<std::int64_t> deadline_ns{};                ///< Of a timer.
  std::optional<std::int64_t> response_ns{}, waiting_ns{};  ///< The parts of a chain's bound.
  std::string dominated_by{};      ///< The largest parts, to reduce for a smaller bound.
  double utilisation_percent = 0;  ///< Of the executor, by setup::Utilisation.
  std::string last_timer{};        ///< Of a chain; if it has no bound, the reason. Only shown.
  /// The same if each sample takes kSomeDelivery to arrive, where the graph states no delivery. A sample on
  /// its way lets a less urgent job start.
  std::optional<std::int64_t> delivered_ns{};
  std::string rests_on{}, assumed{};  ///< Premises that are stated, and those that are not.

  [[nodiscard]] bool violated() const { return bound_ns && observed_ns > bound_ns; }
};

/// A delivery too short to matter but for which job starts next.
inline constexpr Duration kSomeDelivery = std::chrono::nanoseconds(1);

/// For each chain that has some bound the sentence that a person would say first: how old its data may become
/// under which of the executors, by the smallest bounds.
[[nodiscard]] std::vector<std::string> verdict(const std::vector<BoundRow>& rows,
                                               const std::vector<std::string>& executors);

/// The columns of the stored table.
[[nodiscard]] const std::vector<program::Column<BoundRow>>& bound_columns();

/// The rows of tasks, then of chains, then of hot paths, if the method bounds any. `common`: the executor,
/// and what else all rows have.
[[nodiscard]] std::vector<BoundRow> bound_rows(const BoundRow& common, const CallbackGraph& graph,
                                               const GraphBounds& bounds);

/// Response times, end-to-end and hot-path latencies of a run.
class Observed {
 public:
  /// Throws UsageError, which names `--trace`, unless the folder holds a run of these tasks.
  Observed(results::StoredRun& run, const TaskSet& set);

  /// In nanoseconds and in no order.
  [[nodiscard]] const std::vector<std::int64_t>& of(Latency latency, const std::string& executor,
                                                    const std::string& name) const;
  /// Adds the worst observation to a row, and counts what exceeds its bound.
  void compare(BoundRow& row);

  std::size_t compared = 0;     ///< Values with a bound.
  std::size_t violations = 0;   ///< Values beyond it.
  std::string first_violation;  ///< Names the first such row.

 private:
  using Key = std::tuple<Latency, std::string, std::string>;
  std::map<Key, std::vector<std::int64_t>> values_;
};

/// Prints the rows of one method, with the columns of a comparison if `compared`.
void print(std::ostream& out, const std::vector<BoundRow>& rows, bool compared);

/// A graph or a stored run, the phases for which its bounds hold, and where they go.
struct AnalyzeOptions : setup::CommonOptions, setup::PlatformOptions {
  std::string trace, csv, witness;
  bool known_phases = false;  ///< Bounds hold for the phases of these options only.
  std::optional<double> phase_uncertainty_us;
  bool strict = false, exact = false;
};

/// Bounds the worst cases of every executor of `options`, prints them to `out` and writes the files
/// that the options name. Returns the rows of all methods. Throws UsageError and
/// InputError, and RunError if a bound is violated.
std::vector<BoundRow> analyze(const AnalyzeOptions& options, std::ostream& out);

/// Writes a run folder for each worst case below FOLDER/EXECUTOR, the simulated schedule that reaches it,
/// and returns lines that name them. The folder's command repeats the run: it reads the graph, the phases and
/// the execution times from files beside the run folder. `graph` and `tasks` are those of the exploration;
/// `options` are those of the command. Throws UsageError, and RunError if a schedule misses its value.
[[nodiscard]] std::string write_witnesses(const std::vector<bounds::ReachedWorstCase>& worst_cases,
                                          const Graph& graph, const GraphTasks& tasks,
                                          const setup::ExecutorSpec& executor,
                                          const setup::CommonOptions& options,
                                          const std::filesystem::path& folder);

}  // namespace hotpath::guarantees
