// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/input_file.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Header line of jobs.csv (without the newline); docs/results.md explains every column.
extern const std::string kJobsCsvHeader;
extern const std::string kChainsCsvHeader;

/// Appends one row per job and one per skipped timestamp. Instants are nanoseconds since the epoch
/// of the run; a field that does not apply is empty. The caller checks the stream for errors.
void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace);
/// Appends one row per chain record; an unknown end-to-end latency or task is empty. The caller checks the
/// stream for errors.
void write_chains_csv(std::ostream& out, const TaskSet& set, const std::vector<std::string>& chain_names,
                      const Trace& trace);

/// Reads jobs.csv back: one trace per (executor, repetition), in order of appearance. Instants are
/// relative to an epoch of zero; `published`, `end` and `chains` are not in the file and stay
/// empty. Throws InputError, also for a task that is not in `set`.
[[nodiscard]] std::vector<Trace> read_jobs_csv(std::istream& in, const TaskSet& set,
                                               const std::string& file_name);

/// A row of jobs.csv; rows `skipped` are separate. Valid until the next row is read.
struct JobRow {
  std::string_view executor;
  std::uint32_t repetition = 0;
  const JobRecord& record;
  std::size_t line = 0;
};
/// Reads jobs.csv row by row, in memory that does not grow with the file. Throws InputError.
void for_each_job(std::istream& in, const TaskSet& set, const std::string& file_name,
                  const std::function<void(const JobRow&)>& use);

/// Reads jobs.csv job by job, like a Trace: rows `skipped` are counted in their job. Throws
/// InputError.
void for_each_record(std::istream& in, const TaskSet& set, const std::string& file_name,
                     const std::function<void(const JobRow&)>& use);

/// A row of chains.csv.
struct ChainRow {
  std::string executor;
  std::uint32_t repetition = 0;
  std::size_t line = 0;  ///< In the file; counts from 1.
  /// `dropped` is not in the file.
  ChainRecord record;
};
/// Reads chains.csv row by row, in memory that does not grow with the file; `chains` are the names of the
/// run's chains. Throws InputError, also for a chain or task of another run.
void for_each_chain(std::istream& in, const TaskSet& set, const std::vector<std::string>& chains,
                    const std::string& file_name, const std::function<void(const ChainRow&)>& use);

}  // namespace hotpath
