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

/// For each chain with known ages the sentences that a person would say first: under which executor the data
/// is youngest by the 99th percentile of its age, compared with `default` or else with the next best, at what
/// price, and how sure that is; before them the executors that cannot keep up. Executors that starve a task,
/// or that give fewer than 19 of 20 outputs of another one, cannot win.
[[nodiscard]] std::vector<std::string> verdict(const Summary& summary);

/// A latency in milliseconds, a ratio or another measure for people: three digits, at most three decimals;
/// `-`: unknown.
[[nodiscard]] std::string shown_number(double value);
/// A ratio as difference in percent: `-25 %`.
[[nodiscard]] std::string shown_difference(double ratio);
/// Whether the confidence interval of a ratio excludes 1.
[[nodiscard]] bool beyond_noise(const std::optional<Estimate>& ratio);

}  // namespace hotpath::results
