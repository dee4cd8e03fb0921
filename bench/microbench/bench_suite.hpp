// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath {

struct SuiteOptions {
  std::vector<std::string> programs;  ///< Of bench_programs(); empty: all.
  std::uint32_t repetitions = 5;
  std::uint64_t seed = 1;
  bool quick = false;
  double time_out_s = 1200;  ///< Of one program.
  std::string output;
};

/// The benchmark programs without their prefix `bench_`.
std::vector<std::string> bench_programs();

/// Runs the benchmark programs, a fresh process for each repetition, in seeded random order, into one folder:
/// bench.json, the programs' own output below raw/, report.md with its pictures. Throws UsageError, RunError.
void run_suite(const SuiteOptions& options);

}  // namespace hotpath
