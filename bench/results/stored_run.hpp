// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/trace_csv.hpp"
#include "results/run_folder.hpp"
#include "results/run_record.hpp"
#include "results/summary.hpp"

namespace hotpath::results {

/// The folder of a finished live or simulated run. The epoch is time 0.
class StoredRun {
 public:
  /// Reads run.json. Messages name `option`. Throws UsageError for a folder without a complete run.
  StoredRun(std::filesystem::path folder, std::string option);

  const std::filesystem::path& folder() const { return folder_; }
  const RunRecord& record() const { return record_; }  ///< run.json.
  const std::vector<std::string>& executors() const { return record_.executors; }
  Duration warm_up() const { return from_s(record_.warm_up_s); }
  /// Of each repetition as planned, warm-up included.
  Duration length() const { return warm_up() + from_s(record_.duration_s); }
  /// The length of a repetition with this usage, which has the actual length of a live run.
  Duration length_of(const ProcessUsage& usage) const {
    return usage.wall > Duration::zero() ? usage.wall : length();
  }

  /// The entry of a repetition in run.json. Throws UsageError if that executor or repetition did
  /// not run.
  [[nodiscard]] const RepetitionRecord& run(const std::string& executor, std::uint32_t repetition) const;

  /// Opens a file of the folder. Throws UsageError if it is missing, InputError if it is not a
  /// regular file.
  [[nodiscard]] std::ifstream open(const char* file) const;
  /// Reads chains.csv row by row. Throws like open(), and InputError for a file of another run.
  void for_each_chain(const std::function<void(const ChainRow&)>& use) const;

  /// First timestamp of every timer, by task. Throws UsageError if that executor or repetition did
  /// not run, or if the run's timers differ from the timers of `set`.
  [[nodiscard]] std::vector<Duration> first_timestamps(const TaskSet& set, const std::string& executor,
                                                       std::uint32_t repetition) const;

  /// Loads jobs.csv and chains.csv for the tasks of a graph, or those of run.json, into memory. To read job
  /// by job, use for_each_record() of stored_summary.hpp. Throws UsageError for files that are missing, not
  /// of one run, or too large for the memory, InputError for files that are malformed or of another graph.
  void load(const TaskSet& set);

  /// The tasks of run.json, or the tasks given to load().
  const TaskSet& tasks() const { return tasks_; }
  const std::vector<std::string>& chains() const { return record_.chains; }  ///< Their names.
  /// After load(): by executor in the order of executors(), then by repetition.
  const std::vector<Trace>& traces() const { return traces_; }
  /// The trace of a repetition. Throws UsageError if that executor or repetition did not run.
  [[nodiscard]] const Trace& trace(const std::string& executor, std::uint32_t repetition) const;

  /// For summarize().
  [[nodiscard]] SummaryOptions summary_options() const;

  /// Throws InputError for a row of a repetition that jobs.csv lacks.
  [[noreturn]] void refuse_chain(const ChainRow& row) const;
  /// Throws UsageError with option, folder and `what`.
  [[noreturn]] void fail(const std::string& what) const;

  /// Returns read(); nlohmann's exceptions and std::logic_error become UsageError about run.json.
  auto check(const auto& read) const {
    try {
      return read();
    } catch (const nlohmann::json::exception& error) {
      fail_to_read(error.what());
    } catch (const std::logic_error& error) {
      fail_to_read(error.what());
    }
  }

 private:
  [[noreturn]] void fail_to_read(const std::string& why) const {
    fail("its run.json is not one of `hotpath run`: " + why + "; if another version wrote it, run it again");
  }
  /// The entry of `all`. Fails for one that did not run.
  const auto& of_repetition(const auto& all, const std::string& executor, std::uint32_t repetition) const;

  std::filesystem::path folder_;
  std::string option_;
  RunRecord record_;
  TaskSet tasks_;
  std::vector<Trace> traces_;
};

/// Copies an input of a run into its folder, as `name` or else by its kind, and notes it in `record`.
/// Throws RunError if the copy cannot be written, InputError if the input cannot be read.
void keep_input(const RunFolder& folder, RunRecord& record, const std::string& kind,
                const std::filesystem::path& original, std::string name = "");

/// The run's own copy of its input of a kind; none if it had no such input. Warns on standard
/// error, once, if the original has changed since.
[[nodiscard]] std::optional<std::filesystem::path> kept_input(const StoredRun& run, const std::string& kind);

/// {tasks: [{task, response_max_ms, TimerCounts}]} of a golden trace SET.EXECUTOR.csv; deadlines are compared
/// with the authors' response times.
[[nodiscard]] nlohmann::json summarize_golden_trace(const std::filesystem::path& file);

}  // namespace hotpath::results
