// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Header line of jobs.csv (without the newline); README explains every column.
extern const char* const kJobsCsvHeader;
extern const char* const kChainsCsvHeader;

/// Appends one row for every job, and one for each skipped timestamp. Instants are nanoseconds since the
/// epoch of the run; a field that does not apply is empty. Stream errors are the caller's to check.
void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace);
void write_chains_csv(std::ostream& out, const std::vector<std::string>& chain_names, const Trace& trace);

/// A malformed jobs.csv: the message names the line, what is wrong and what would be right.
struct TraceCsvError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads jobs.csv back: one trace per (executor, repetition), in order of appearance. Instants are relative
/// to an epoch of zero; `published`, `end` and `chains` are not in this file and stay empty. Throws
/// TraceCsvError, also for a task that `set` does not have.
std::vector<Trace> read_jobs_csv(std::istream& in, const TaskSet& set, const std::string& file_name);

}  // namespace hotpath
