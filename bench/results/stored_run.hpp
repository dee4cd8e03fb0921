// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// The folder of a finished run, live or simulated. Instants count from an epoch of zero.
class StoredRun {
 public:
  /// Reads run.json. `option` is named in messages. Throws UsageError for a folder that holds no whole run,
  /// or one of a version that kept less of it.
  StoredRun(std::filesystem::path folder, std::string option);

  const std::filesystem::path& folder() const { return folder_; }
  const nlohmann::json& facts() const { return facts_; }  ///< run.json.
  unsigned cores() const { return cores_; }               ///< Processors that the run could use.
  const std::vector<std::string>& executors() const { return executors_; }  ///< As asked for.
  Duration warm_up() const { return warm_up_; }
  Duration length() const { return length_; }  ///< Of each repetition as planned, warm-up included.
  /// The same of a repetition with that usage, which tells of a live run when it ended.
  Duration length_of(const ProcessUsage& usage) const {
    return usage.wall > Duration::zero() ? usage.wall : length_;
  }

  /// Its entry in run.json. Throws UsageError when that executor or repetition did not run.
  [[nodiscard]] const nlohmann::json& run(const std::string& executor, std::uint32_t repetition) const;

  /// Whether a repetition was measured again on a faster processor: it is kept, and counts for nothing.
  [[nodiscard]] bool replaced(const std::string& executor, std::uint32_t repetition) const {
    return run(executor, repetition).contains("replaced_by");
  }

  /// One of the files. Throws UsageError when it is not there, InputError for what is no regular file.
  [[nodiscard]] std::ifstream open(const char* file) const;

  /// First timestamp of every timer, by task. Throws UsageError when that executor or repetition did not run,
  /// or when the timers are not those of `set`.
  [[nodiscard]] std::vector<Duration> first_timestamps(const TaskSet& set, const std::string& executor,
                                                       std::uint32_t repetition) const;

  /// Reads jobs.csv and chains.csv for the tasks of a graph, or for those that the run itself names. All jobs
  /// are then in memory: what needs them one at a time takes for_each_record() of stored_summary.hpp. Throws
  /// UsageError for files that are missing, not of one run, or too large for the memory that there is,
  /// InputError for what is malformed or of another graph.
  void load(const TaskSet& set);
  void load();

  const TaskSet& tasks() const {
    return tasks_;
  }  ///< Those that the run names, or that were given to load().
  const std::vector<std::string>& chains() const { return chains_; }  ///< Their names.
  /// After load(): by executor in the order of executors(), then by repetition.
  const std::vector<Trace>& traces() const { return traces_; }
  /// One of them. Throws UsageError when that executor or repetition did not run.
  [[nodiscard]] const Trace& trace(const std::string& executor, std::uint32_t repetition) const;

  /// For summarize().
  [[nodiscard]] SummaryOptions summary_options() const;

  /// Throws UsageError: option, folder, `what`.
  [[noreturn]] void fail(const std::string& what) const;

  /// What `read` reads of a file; nlohmann's exceptions and std::out_of_range become UsageError.
  auto check(const auto& read, const char* file = "run.json") const {
    try {
      return read();
    } catch (const nlohmann::json::exception& error) {
      fail_to_read(file, error.what());
    } catch (const std::out_of_range& error) {
      fail_to_read(file, error.what());
    }
  }

 private:
  [[noreturn]] void fail_to_read(const char* file, const std::string& why) const {
    fail(std::string("its ") + file + " is not one of `hotpath run`: " + why);
  }
  [[noreturn]] void fail_missing(const std::string& executor, std::uint32_t repetition) const;
  void read_facts();
  void read_jobs();
  void read_chains();

  std::filesystem::path folder_;
  std::string option_;
  nlohmann::json facts_;
  unsigned cores_ = 1;
  std::vector<std::string> executors_, chains_;
  Duration warm_up_{}, length_{};
  TaskSet tasks_;
  std::vector<Trace> traces_;
};

/// What became of each timer of a golden trace, by the authors' definition of a response time: {tasks:
/// [{task, reached, ran, skipped, deadline_overruns, response_authors_ms: quantiles}]}.
[[nodiscard]] nlohmann::json summarize_golden_trace(const std::filesystem::path& file);

}  // namespace hotpath
