// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "hotpath/core/trace_csv.hpp"
#include "results/stored_run.hpp"

namespace hotpath::results {

/// Calls `use` for every job of a stored run, in the order of jobs.csv. Throws InputError, also if
/// the rows of a repetition are not contiguous.
void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use);

/// The summary of a stored run, read row by row: needs 8 bytes per job and 8 more per job of a timer, and of
/// the current repetition 16 bytes per job of a timer, for sets without subscriptions 48. Calls `also` for
/// every job. Throws UsageError for files that are missing or not of one run, InputError for malformed files.
[[nodiscard]] Summary summarize(
    const StoredRun& run, const SummaryOptions& options,
    const std::function<void(const JobRow&)>& also = [](const JobRow&) {});

/// Writes CSV `executor,repetition,task,response_ns` with a row per counted job, in the order of
/// run.json's executors, then by repetition, then in the order of jobs.csv, without replaced
/// repetitions. Buffers rows that come too early.
class ResponsesCsv {
 public:
  ResponsesCsv(std::ostream& out, const StoredRun& run);
  void add(const JobRow& row);
  /// Writes the buffered rows.
  void finish();

 private:
  struct Response {
    TaskId task;
    std::int64_t ns;
  };
  struct OfRepetition {
    std::string executor;
    std::uint32_t repetition = 0;
    bool seen = false;  ///< It has had rows, or has no rows to write.
    std::deque<Response> waiting;
  };
  void write(const OfRepetition& of, const Response& response);
  void write_waiting(OfRepetition& of);

  std::ostream& out_;
  const StoredRun& run_;
  std::vector<OfRepetition> repetitions_;  // in the order of the file
  std::size_t next_ = 0;                   // index of the first repetition that is not completely written
  std::size_t current_ = 0;                // index of the repetition of the latest row
};

}  // namespace hotpath::results
