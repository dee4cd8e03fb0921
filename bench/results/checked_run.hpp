// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace hotpath::results {

struct CheckedRun {
  std::uint64_t rows = 0;  ///< Rows of jobs.csv.
  std::size_t repetitions = 0;
};

/// Checks jobs.csv of a stored run, row by row, against the rules of every schedule (ScheduleCheck)
/// and against run.json: the expected timestamps and samples, and the listed repetitions. Throws
/// RunError with the line of a violation, UsageError and InputError like StoredRun.
CheckedRun check_run(const std::filesystem::path& folder);

}  // namespace hotpath::results
