// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "results/stored_run.hpp"

namespace hotpath::page {

/// Intervals since the epoch of a repetition.
using Intervals = std::vector<std::pair<Time, Time>>;
/// By executor and repetition.
using WantedIntervals = std::map<std::pair<std::string, std::uint32_t>, Intervals>;

/// A started job in a page; web/src/data.ts names the numbers.
using PageJob = std::array<std::int64_t, 7>;
[[nodiscard]] PageJob job_row(const JobRecord& job);

/// The number of jobs of a run that started; 0 without jobs.csv. Throws InputError.
[[nodiscard]] std::size_t count_jobs(const results::StoredRun& run);

struct ShownJobs {
  /// [{executor, repetition, length_ns, kept_ns: [[from, to]...], jobs}], in the order of the file. The
  /// numbers of jobs are in columns, and sequences and starts as differences, which compress well.
  nlohmann::json repetitions = nlohmann::json::array();
  std::size_t started = 0, kept = 0;
};

/// The jobs of a run that a page shows: all, if at most `most` of them started, or those that start in the
/// wanted intervals, and the first ones of each executor. `all` jobs are count_jobs(). Throws InputError.
[[nodiscard]] ShownJobs shown_jobs(const results::StoredRun& run, std::size_t all, std::size_t most,
                                   WantedIntervals wanted);

}  // namespace hotpath::page
