// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// A part of one repetition; instants since its epoch.
struct TraceWindow {
  std::string executor;
  std::uint32_t repetition = 0;
  Time from{}, to = kNever;
};

/// Writes the header of a jobs.csv, and its rows that touch the window [from, to): those of jobs that were
/// ready, ran or were skipped or overwritten in it. Only what decides that is read, row by row. Throws
/// InputError.
void write_window(std::ostream& out, const std::filesystem::path& jobs_csv, const TraceWindow& window);

}  // namespace hotpath
