// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "comparison/comparison.hpp"
#include "comparison/judgement.hpp"
#include "program/table.hpp"

namespace hotpath::comparison {

/// The verdict on one quantile, of which less is better.
[[nodiscard]] Verdict verdict_of(const Samples& old, const Samples& now, const Estimate& change);

/// Median, p99 and maximum of all that both sides have. Simulated repetitions of equal draws are pairs.
struct Percentiles {
  program::Table stored, shown;  ///< With a column for each part of the key, or with the key in words.
  std::map<Latency, std::map<Verdict, std::size_t>> verdicts;
};
[[nodiscard]] Percentiles percentiles_of(const Side& before, const Side& after);

/// Prints the medians of all counters of two results of `hotpath bench`. Throws UsageError, InputError.
void compare_counters(const Options& options);

/// The judgements as rows; `worst_first`: those that became worse before the others.
[[nodiscard]] program::Table rows_of(const std::vector<Judgement>& judgements, bool worst_first);
/// The result in one sentence (without the bracket at its end), and the smallest growth that raises an alarm.
[[nodiscard]] std::string verdict_of(const std::map<Verdict, std::size_t>& verdicts,
                                     const std::string& things);
[[nodiscard]] std::string verdict_of(const std::vector<Judgement>& judgements);
[[nodiscard]] std::string power_of(const std::vector<Judgement>& judgements);
/// The judgements as data: latencies in ms and their growth as a ratio, counts and their difference.
[[nodiscard]] nlohmann::json json_of(const std::vector<Judgement>& judgements);
/// JUnit report with a test case for each judgement, and a summary for a pull request.
[[nodiscard]] std::string junit_of(const std::vector<Judgement>& judgements);
[[nodiscard]] std::string markdown_of(const std::vector<Judgement>& judgements, const Options& options);

/// Writes `options.output`: comparison.json and, by the Python package, report.html and report.md from it.
/// The page reads runs itself; of others it has the distributions. Throws UsageError and RunError.
void write_page(const Options& options, const Side& before, const Side& after,
                const std::vector<std::string>& sentences, const std::string& title,
                const program::Table& table);

}  // namespace hotpath::comparison
