// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "hotpath/core/trace_csv.hpp"
#include "results/stored_run.hpp"

namespace hotpath {

/// Every job of a stored run in the order of jobs.csv. Throws InputError, also where a repetition's rows do
/// not follow each other.
void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use);

/// The summary of a stored run, which is read row by row: 8 bytes stay of each job, and in sets of timers
/// alone 32 of each job of the current repetition. `also` gets every job. Throws UsageError for files that
/// are missing or not of one run, InputError for what is malformed.
[[nodiscard]] Summary summarize(
    const StoredRun& run, const SummaryOptions& options,
    const std::function<void(const JobRow&)>& also = [](const JobRow&) {});

/// CSV `executor,repetition,task,response_ns`: a row for each job that ran and counts, by executor as
/// run.json names them and by repetition, then in the order of jobs.csv, without repetitions that were
/// replaced. Rows that come too early are kept until then.
class ResponsesCsv {
 public:
  ResponsesCsv(std::ostream& out, const StoredRun& run);
  void add(const JobRow& row);
  /// Writes what still waits.
  void finish();

 private:
  struct Response {
    TaskId task;
    std::int64_t ns;
  };
  struct OfRepetition {
    std::string executor;
    std::uint32_t repetition = 0;
    bool replaced = false;
    bool seen = false;  ///< It has had rows, or has none.
    std::deque<Response> waiting;
  };
  void write(const OfRepetition& of, const Response& response);
  void write_waiting(OfRepetition& of);

  std::ostream& out_;
  const StoredRun& run_;
  std::vector<OfRepetition> repetitions_;  // in the order of the file
  std::size_t next_ = 0;                   // of the first that is not written, or that is being written
  std::size_t current_ = 0;                // of the latest row
};

}  // namespace hotpath
