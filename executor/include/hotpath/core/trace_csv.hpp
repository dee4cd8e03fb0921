// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/input_error.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Header line of jobs.csv (without the newline); docs/results.md explains every column.
extern const std::string kJobsCsvHeader;
extern const std::string kChainsCsvHeader;

/// Appends one row for every job, and one for each skipped timestamp. Instants are nanoseconds since the
/// epoch of the run; a field that does not apply is empty. Stream errors are the caller's to check.
void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace);
void write_chains_csv(std::ostream& out, const std::vector<std::string>& chain_names, const Trace& trace);

/// Reads jobs.csv back: one trace per (executor, repetition), in order of appearance. Instants are relative
/// to an epoch of zero; `published`, `end` and `chains` are not in this file and stay empty. Throws
/// InputError, also for a task that `set` does not have.
[[nodiscard]] std::vector<Trace> read_jobs_csv(std::istream& in, const TaskSet& set,
                                               const std::string& file_name);

/// A row of jobs.csv: `skipped` rows stand for themselves. Valid until the next one is read.
struct JobRow {
  std::string_view executor;
  std::uint32_t repetition = 0;
  const JobRecord& record;
  std::size_t line = 0;
};
/// The same row by row, in memory that does not grow with the file. Throws InputError.
void for_each_job(std::istream& in, const TaskSet& set, const std::string& file_name,
                  const std::function<void(const JobRow&)>& use);

/// The same job by job, as a Trace has them: rows `skipped` are counted in their job.
void for_each_record(std::istream& in, const TaskSet& set, const std::string& file_name,
                     const std::function<void(const JobRow&)>& use);

/// A jobs.csv with the tasks that it tells of, in order of appearance.
struct JobsCsv {
  /// Names and kinds; of timers also the period, as two timestamps of one run tell it (0 where there is only
  /// one), and the relative deadline (0 where none is recorded).
  TaskSet set;
  std::vector<Trace> traces;
};
/// The same without the graph that ran. Throws InputError.
[[nodiscard]] JobsCsv read_jobs_csv(std::istream& in, const std::string& file_name);

/// A row of chains.csv.
struct ChainRow {
  std::string executor;
  std::uint32_t repetition = 0;
  std::string chain;
  std::size_t line = 0;  ///< In the file; counts from 1.
  ChainRecord record;    ///< `chain` counts the names in order of appearance; `dropped` is not in this file.
};
/// All rows in the file's order; the second in memory that does not grow with the file. Throw InputError.
[[nodiscard]] std::vector<ChainRow> read_chains_csv(std::istream& in, const std::string& file_name);
void for_each_chain(std::istream& in, const std::string& file_name,
                    const std::function<void(const ChainRow&)>& use);

}  // namespace hotpath
