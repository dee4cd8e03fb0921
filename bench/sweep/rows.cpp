// SPDX-License-Identifier: Apache-2.0
#include "sweep/rows.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/time.hpp"

namespace hotpath::sweep {

namespace {

void add_executor(const results::ExecutorSummary& executor, MeasuredRow& row) {
  row.executor = executor.executor;
  row.callbacks = executor.executed;
  row.skipped = executor.skipped;
  row.overwritten = executor.overwritten;
  row.deadline_overruns = executor.after_warm_up.deadline_overruns;
  for (const results::TaskSummary& task : executor.tasks) {
    row.longest_wait_ms = std::max(row.longest_wait_ms, to_ms(task.longest_wait));
    row.never_ran += task.never_ran();
    if (task.kind != TaskKind::timer || task.response_ms.n == 0) continue;
    const double share = task.response_ms.max / to_ms(task.deadline);
    row.response_share_max = std::max(row.response_share_max.value_or(0), share);
  }
}

}  // namespace

std::optional<double> finite(double value) {
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::vector<MeasuredRow> measured_rows(const results::Summary& summary) {
  std::vector<MeasuredRow> rows;
  for (const results::ExecutorSummary& executor : summary.executors) {
    MeasuredRow common;
    add_executor(executor, common);
    if (executor.chains.empty()) rows.push_back(common);
    for (const results::ChainSummary& chain : executor.chains) {
      MeasuredRow& row = rows.emplace_back(common);
      const Quantiles &hot = chain.hot_path.quantiles, &whole = chain.end_to_end.quantiles;
      row.chain = chain.chain;
      row.samples = hot.n;
      row.drops = chain.drops;
      row.hot_path_p50_ms = finite(hot.p50);
      row.hot_path_p99_ms = finite(hot.p99);
      row.hot_path_max_ms = finite(hot.max);
      row.end_to_end_p50_ms = finite(whole.p50);
      row.end_to_end_max_ms = finite(whole.max);
    }
  }
  return rows;
}

const std::vector<program::Column<MeasuredRow>>& measured_columns() {
  constexpr const char* kDigits12 = "%.12g";
  static const std::vector<program::Column<MeasuredRow>> columns = {
      {"executor", &MeasuredRow::executor},
      {"chain", &MeasuredRow::chain},
      {"samples", &MeasuredRow::samples},
      {"hot_path_p50_ms", &MeasuredRow::hot_path_p50_ms, kDigits12},
      {"hot_path_p99_ms", &MeasuredRow::hot_path_p99_ms, kDigits12},
      {"hot_path_max_ms", &MeasuredRow::hot_path_max_ms, kDigits12},
      {"end_to_end_p50_ms", &MeasuredRow::end_to_end_p50_ms, kDigits12},
      {"end_to_end_max_ms", &MeasuredRow::end_to_end_max_ms, kDigits12},
      {"drops", &MeasuredRow::drops},
      {"callbacks", &MeasuredRow::callbacks},
      {"skipped", &MeasuredRow::skipped},
      {"overwritten", &MeasuredRow::overwritten},
      {"lost", &MeasuredRow::lost},
      {"deadline_overruns", &MeasuredRow::deadline_overruns},
      {"response_share_max", &MeasuredRow::response_share_max, kDigits12},
      {"longest_wait_ms", &MeasuredRow::longest_wait_ms, kDigits12},
      {"never_ran", &MeasuredRow::never_ran}};
  return columns;
}

}  // namespace hotpath::sweep
