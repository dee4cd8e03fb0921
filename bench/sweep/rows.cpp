// SPDX-License-Identifier: Apache-2.0
#include "sweep/rows.hpp"

#include <algorithm>
#include <cmath>

namespace hotpath::sweep {

std::optional<double> finite(double value) {
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<double> response_share_max(const results::ExecutorSummary& executor) {
  std::optional<double> most;
  for (const results::TaskSummary& task : executor.tasks) {
    if (task.kind == TaskKind::timer && task.response_ms.n > 0)
      most = std::max(most.value_or(0), task.response_ms.max / to_ms(task.deadline));
  }
  return most;
}

program::Table measured_table(const results::Summary& summary) {
  program::Table table(
      "", {"executor", "chain", "samples", "hot_path_p50_ms", "hot_path_p99_ms", "hot_path_max_ms",
           "end_to_end_p50_ms", "end_to_end_max_ms", "drops", "callbacks", "skipped", "overwritten", "lost",
           "deadline_overruns", "response_share_max", "longest_wait_ms", "never_ran"});
  constexpr const char* kDigits12 = "%.12g";
  const auto ms = [](double value) { return program::Value(finite(value), kDigits12); };
  for (const results::ExecutorSummary& e : summary.executors) {
    Duration longest_wait{};
    for (const results::TaskSummary& task : e.tasks) longest_wait = std::max(longest_wait, task.longest_wait);
    std::vector<results::ChainSummary> chains = e.chains;
    if (chains.empty()) chains.emplace_back();
    for (const results::ChainSummary& c : chains) {
      const Quantiles &hot_path = c.hot_path.quantiles, &age = c.end_to_end.quantiles;
      table.add_row({e.executor, c.chain, hot_path.n, ms(hot_path.p50), ms(hot_path.p99), ms(hot_path.max),
                     ms(age.p50), ms(age.max), c.drops, e.executed, e.skipped, e.overwritten, e.lost(),
                     e.after_warm_up.deadline_overruns, program::Value(response_share_max(e), kDigits12),
                     ms(to_ms(longest_wait)), e.never_ran()});
    }
  }
  return table;
}

}  // namespace hotpath::sweep
