// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "page/columns.hpp"
#include "results/stored_run.hpp"

namespace hotpath::page {

/// Started jobs of one repetition. Columns hold differences where these are small numbers, which
/// compress well.
class JobColumns {
 public:
  explicit JobColumns(TaskId tasks) : last_sequence_(tasks, 0) {}

  /// Adds a job, in order of start.
  void add(const JobRecord& job);
  [[nodiscard]] nlohmann::json columns() const { return columns_.json(); }

 private:
  Columns<9> columns_{{"task", "sequence", "start", "length", "before_timestamp", "before_release", "worker",
                       "parent", "parent_sequence"}};
  std::vector<std::uint64_t> last_sequence_;  // by task
  Time last_start_{};
};

/// By executor and repetition.
using WantedIntervals = std::map<std::pair<std::string, std::uint32_t>, std::vector<Interval>>;

/// The number of jobs of a run that started; 0 without jobs.csv. Throws InputError.
[[nodiscard]] std::size_t count_jobs(const results::StoredRun& run);

/// The jobs of a run that a page shows: all, or at most `most` of them: those that start in the
/// wanted intervals, and the first ones of each executor. Throws InputError.
class StoredJobs {
 public:
  /// `all` jobs that started are count_jobs().
  StoredJobs(const results::StoredRun& run, std::size_t all, std::size_t most, WantedIntervals wanted);

  [[nodiscard]] std::size_t started() const { return started_; }
  [[nodiscard]] std::size_t kept() const { return kept_; }
  /// {executor, repetition, length_ns, kept_ns: [[from, to]...], jobs}, in the order of the file.
  [[nodiscard]] nlohmann::json repetitions() const;

 private:
  struct OfRepetition {
    std::string executor;
    std::uint32_t repetition = 0;
    JobColumns jobs;
    std::vector<Interval> wanted;  ///< Disjoint, ascending.
    Time first_left_out = kNever;  ///< Of the jobs outside of these intervals.
  };

  void begin(const std::string& executor, std::uint32_t repetition, WantedIntervals& wanted);
  [[nodiscard]] bool keeps(OfRepetition& of, const JobRecord& job);
  [[nodiscard]] std::vector<Interval> kept_intervals(const OfRepetition& of, Time end) const;

  const results::StoredRun& run_;
  const std::size_t most_;
  std::vector<OfRepetition> repetitions_;
  std::map<std::string, std::size_t> first_;  // jobs kept outside of wanted intervals, by executor
  std::size_t started_ = 0, kept_ = 0;
};

}  // namespace hotpath::page
