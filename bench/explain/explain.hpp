// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hotpath::explain {

/// The command line of `hotpath explain`.
struct Options {
  std::string run;
  std::string other;                        ///< A second run, to compare.
  std::vector<std::string> executors;       ///< At most two; empty: the first of the run.
  std::optional<std::uint32_t> repetition;  ///< std::nullopt: all.
  std::string chain;                        ///< Empty: the first of the graph.
  std::string task;                         ///< Response times of this task in place of a chain.
  bool worst = false;
  std::optional<double> quantile;  ///< In [0, 1].
  std::optional<std::uint64_t> sequence;
  bool json = false;  ///< Instead of text.
};

/// Explains one output, many outputs, or the difference of two executors. Reads jobs.csv row by row;
/// memory grows with the number of outputs and with the jobs that overlap the longest latency.
/// Throws UsageError and InputError.
void explain(const Options& options);

}  // namespace hotpath::explain
