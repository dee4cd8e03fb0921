// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

#include "hotpath/core/time.hpp"

namespace hotpath::results {

/// A time window of one repetition, counted from its epoch.
struct TraceWindow {
  std::string executor;
  std::uint32_t repetition = 0;
  Time from{}, to = kNever;
};

/// Writes the header of a jobs.csv and the rows of jobs that were ready, running, skipped or
/// overwritten in the window [from, to). Reads row by row and parses only the columns needed.
/// Throws InputError.
void write_window(std::ostream& out, const std::filesystem::path& jobs_csv, const TraceWindow& window);

}  // namespace hotpath::results
