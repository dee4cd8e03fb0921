// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "results/stored_run.hpp"

namespace hotpath::results {

/// Calls `use` for every job of a stored run, in the order of jobs.csv. Throws InputError, also if
/// the rows of a repetition are not contiguous.
void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use);

/// The summary of a stored run, read row by row. Throws UsageError for files that are
/// missing or not of one run, InputError for malformed files.
[[nodiscard]] Summary summarize(const StoredRun& run, const SummaryOptions& options);

/// Samples of a chain or task in a repetition, in the order of the file: {name, executor, repetition}, of a
/// chain with `hot_path_ms` and `age_ms` (null: unknown), of a task with the `response_ms` of counted jobs.
using SampleRows = std::vector<nlohmann::json>;
/// Those of a run. Throw like StoredRun and for_each_record(), UsageError for a repetition that run.json
/// lacks.
[[nodiscard]] SampleRows chain_samples(const StoredRun& run);
[[nodiscard]] SampleRows response_samples(const StoredRun& run);
/// Adds an output of a chain.
void add(nlohmann::json& samples, const ChainRecord& output);

/// Samples for estimates: a single repetition becomes blocks of consecutive samples, unless it is `exact`:
/// has no sampling error.
[[nodiscard]] RepeatedSamples resampled(std::vector<std::vector<double>> repetitions, bool exact);

/// The curve of a distribution with its intervals, in ms rounded to nanoseconds: {n, q, value, low, high}.
[[nodiscard]] nlohmann::json curve_of(const RepeatedSamples& samples);

struct CheckedRun {
  std::uint64_t rows = 0;  ///< Rows of jobs.csv.
  std::size_t repetitions = 0;
};
/// Checks jobs.csv of a stored run, row by row, against the rules of every schedule (ScheduleCheck)
/// and against run.json: the expected timestamps and samples, and the listed repetitions. Throws
/// RunError with the line of a violation, UsageError and InputError like StoredRun.
CheckedRun check_run(const std::filesystem::path& folder);

/// Turns the folder of a killed run into a result: keeps the repetitions that run.json names, drops
/// the rows of the interrupted repetition, and sets `partial` in run.json. Throws UsageError if the
/// run is still running, is whole, or had not finished a repetition; InputError for malformed
/// files; RunError if the folder cannot be written, which then stays unchanged.
Summary recover_run(const std::filesystem::path& folder);

}  // namespace hotpath::results
