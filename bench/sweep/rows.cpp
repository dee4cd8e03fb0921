// SPDX-License-Identifier: Apache-2.0
#include "sweep/rows.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/time.hpp"

namespace hotpath::sweep {

namespace {

double longest_wait_ms(const MeasuredRow& row) {
  Duration longest{};
  for (const results::TaskSummary& task : row.executor->tasks) longest = std::max(longest, task.longest_wait);
  return to_ms(longest);
}

}  // namespace

std::optional<double> finite(double value) {
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<double> MeasuredRow::response_share_max() const {
  std::optional<double> most;
  for (const results::TaskSummary& task : executor->tasks) {
    if (task.kind == TaskKind::timer && task.response_ms.n > 0)
      most = std::max(most.value_or(0), task.response_ms.max / to_ms(task.deadline));
  }
  return most;
}

program::Table measured_table(const results::Summary& summary) {
  using Row = MeasuredRow;
  const auto of_executor = [](auto member) { return [=](const Row& r) { return r.executor->*member; }; };
  const auto latency = [](results::LatencySummary results::ChainSummary::*of, double Quantiles::*quantile) {
    return [=](const Row& r) { return r.chain ? finite((r.chain->*of).quantiles.*quantile) : std::nullopt; };
  };
  using Chain = results::ChainSummary;
  using Executor = results::ExecutorSummary;
  constexpr const char* kDigits12 = "%.12g";
  const std::vector<program::Column<Row>> columns = {
      {"executor", of_executor(&Executor::executor)},
      {"chain", [](const Row& r) { return r.chain ? r.chain->chain : ""; }},
      {"samples", [](const Row& r) { return r.chain ? r.chain->hot_path.quantiles.n : 0; }},
      {"hot_path_p50_ms", latency(&Chain::hot_path, &Quantiles::p50), kDigits12},
      {"hot_path_p99_ms", latency(&Chain::hot_path, &Quantiles::p99), kDigits12},
      {"hot_path_max_ms", latency(&Chain::hot_path, &Quantiles::max), kDigits12},
      {"end_to_end_p50_ms", latency(&Chain::end_to_end, &Quantiles::p50), kDigits12},
      {"end_to_end_max_ms", latency(&Chain::end_to_end, &Quantiles::max), kDigits12},
      {"drops", [](const Row& r) { return r.chain ? r.chain->drops : 0; }},
      {"callbacks", of_executor(&Executor::executed)},
      {"skipped", of_executor(&Executor::skipped)},
      {"overwritten", of_executor(&Executor::overwritten)},
      {"lost", [](const Row& r) { return r.executor->lost(); }},
      {"deadline_overruns", [](const Row& r) { return r.executor->after_warm_up.deadline_overruns; }},
      {"response_share_max", &Row::response_share_max, kDigits12},
      {"longest_wait_ms", longest_wait_ms, kDigits12},
      {"never_ran", [](const Row& r) { return r.executor->never_ran(); }}};
  std::vector<Row> rows;
  for (const Executor& executor : summary.executors) {
    if (executor.chains.empty()) rows.push_back({&executor, nullptr});
    for (const Chain& chain : executor.chains) rows.push_back({&executor, &chain});
  }
  return program::table_of(columns, rows);
}

}  // namespace hotpath::sweep
