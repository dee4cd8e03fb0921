// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"

namespace hotpath {

/// An executor as a user names it: `NAME`, or `NAME:VARIANT[:VARIANT]` with the variants `inherit`, `first`
/// (rule for subscriptions), `lifo`, `fifo` (ties), or a number of threads for `multi`.
struct ExecutorSpec {
  std::string label;  ///< As given; the column `executor`.
  const ExecutorEntry* entry = nullptr;
  SchedulerOptions scheduler;
};

/// Throws UsageError that lists what there is.
ExecutorSpec parse_executor(const std::string& text, const SchedulerOptions& defaults);

/// The paper's executors (Section VII), and all of the registry.
std::vector<std::string> paper_executor_names();
std::vector<std::string> all_executor_names();

}  // namespace hotpath
