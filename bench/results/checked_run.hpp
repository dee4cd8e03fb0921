// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace hotpath {

struct CheckedRun {
  std::uint64_t rows = 0;  ///< Of jobs.csv.
  std::size_t repetitions = 0;
};

/// Holds jobs.csv of a stored run, row by row, against what must be true of any schedule (ScheduleCheck) and
/// against run.json: the timestamps and samples that there were, and the repetitions that it names. Throws
/// RunError with the line where it is not true, UsageError and InputError as StoredRun does.
CheckedRun check_run(const std::filesystem::path& folder);

}  // namespace hotpath
