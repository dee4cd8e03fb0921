// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/registry.hpp"
#include "validation/schedule_comparison.hpp"

namespace hotpath {

/// The simulator against the real stack, job by job: one task set under one executor.
struct GoldenValidation {
  std::string set, executor;
  Platform costs;  ///< As charged in `with_costs`.
  ScheduleComparison without_costs, with_costs;
  std::string verdict;  ///< A sentence without its end.
};

/// All golden traces, REFERENCE/traces/SET.EXECUTOR.csv. Throws UsageError for files that cannot be read.
std::vector<GoldenValidation> validate_golden_traces(const std::filesystem::path& reference);

/// Where the golden trace of a task set under an executor is, if there is one.
std::filesystem::path golden_trace_file(const std::filesystem::path& reference, const std::string& set,
                                        const ExecutorEntry& executor);

/// What the real stack did. Throws InputError.
Schedule golden_schedule(const std::filesystem::path& file, const ExecutorEntry& executor);

}  // namespace hotpath
