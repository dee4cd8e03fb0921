// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The folder of a finished run, live or simulated, as input of a simulation of the same graph, or of a
/// replay.
class MeasuredRun {
 public:
  /// `option` is named in messages. Throws UsageError for a folder that holds no whole run.
  MeasuredRun(const std::filesystem::path& folder, std::string option);

  /// First timestamp of every timer, by task. Throws UsageError when that executor or repetition did not run,
  /// or when the timers are not those of `set`.
  std::vector<Duration> first_timestamps(const TaskSet& set, const std::string& executor,
                                         std::uint32_t repetition) const;

  const std::filesystem::path& folder() const { return folder_; }
  const nlohmann::json& facts() const { return facts_; }
  unsigned cores() const { return cores_; }

  /// Reads jobs.csv. Throws UsageError for one that is malformed or of another graph.
  void load_jobs(const TaskSet& set);
  const std::vector<Trace>& traces() const { return traces_; }
  /// One of them. Throws UsageError when that executor or repetition did not run.
  const Trace& trace(const std::string& executor, std::uint32_t repetition) const;

  /// Execution times measured then; load_jobs() was called.
  std::unique_ptr<ExecutionTimes> execution_times(const Graph& graph, const GraphTasks& tasks,
                                                  const std::string& executor,
                                                  std::uint32_t repetition) const;

 private:
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_missing(const std::string& executor, std::uint32_t repetition,
                                 const std::vector<std::string>& there_are) const;

  std::filesystem::path folder_;
  std::string option_;
  struct Start {
    std::string executor;
    std::uint32_t repetition = 0;
    std::vector<std::pair<std::string, double>> first_timestamps_ms;
  };
  std::vector<Start> starts_;
  nlohmann::json facts_;
  unsigned cores_ = 1;
  std::vector<Trace> traces_;
};

}  // namespace hotpath
