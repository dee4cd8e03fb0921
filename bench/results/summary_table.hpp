// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath::results {

enum class Detail { short_answer, all };

/// Writes the verdict(), then for each chain a table of the ages with a row per executor, each interval below
/// its value; with `all` also its outputs, all jobs and the least regular timers. A graph without chains has
/// a table of jobs. At most ten starved tasks per executor follow: tasks that never ran, and timers with a
/// job that waited longer than the period; then what could mislead, such as a broken loss equation. Plain
/// ASCII, at most 120 columns if executor names have at most 9 characters and latencies are below 1 s. `-`:
/// not measured.
void write_table(std::ostream& out, const Summary& summary, Detail detail = Detail::all);

/// A latency in milliseconds, a ratio or another measure for people: three digits, at most three decimals;
/// `-`: unknown.
[[nodiscard]] std::string shown_number(double value);
/// A ratio as difference in percent: `-25 %`.
[[nodiscard]] std::string shown_difference(double ratio);
/// Whether the confidence interval of a ratio excludes 1.
[[nodiscard]] bool beyond_noise(const std::optional<Estimate>& ratio);

}  // namespace hotpath::results
