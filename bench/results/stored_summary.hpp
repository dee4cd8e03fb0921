// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "hotpath/core/trace_csv.hpp"
#include "results/stored_run.hpp"

namespace hotpath::results {

/// Calls `use` for every job of a stored run, in the order of jobs.csv. Throws InputError, also if
/// the rows of a repetition are not contiguous.
void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use);

/// The summary of a stored run, read row by row with ExecutorMeasures. Throws UsageError for files that are
/// missing or not of one run, InputError for malformed files.
[[nodiscard]] Summary summarize(const StoredRun& run, const SummaryOptions& options);

/// {tasks, repetitions: [{executor, repetition, task, ns}]}: the response times of the counted jobs and
/// the places of their tasks, in the order of run.json's executors, then by repetition, then in the order of
/// jobs.csv. Throws like for_each_record(), and UsageError for a repetition that run.json lacks.
[[nodiscard]] nlohmann::json responses(const StoredRun& run);

}  // namespace hotpath::results
