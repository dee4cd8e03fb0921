// SPDX-License-Identifier: Apache-2.0
#include "sweep/rows.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "hotpath/core/time.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

namespace {

std::optional<double> value(double v) { return std::isfinite(v) ? std::optional(v) : std::nullopt; }

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

const char* const kMeasuredColumns =
    "executor,chain,samples,hot_path_p50_ms,hot_path_p99_ms,hot_path_max_ms,end_to_end_p50_ms,"
    "end_to_end_max_ms,drops,callbacks,skipped,overwritten,lost,deadline_overruns,response_share_max,"
    "longest_wait_ms,never_ran";

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
      row.hot_path_p50_ms = value(hot.p50);
      row.hot_path_p99_ms = value(hot.p99);
      row.hot_path_max_ms = value(hot.max);
      row.end_to_end_p50_ms = value(whole.p50);
      row.end_to_end_max_ms = value(whole.max);
    }
  }
  return rows;
}

std::string csv_of(const MeasuredRow& row) {
  std::ostringstream line;
  line.precision(12);
  program::write_row(line, row.executor, row.chain, row.samples, row.hot_path_p50_ms, row.hot_path_p99_ms,
                     row.hot_path_max_ms, row.end_to_end_p50_ms, row.end_to_end_max_ms, row.drops,
                     row.callbacks, row.skipped, row.overwritten, row.lost(), row.deadline_overruns,
                     row.response_share_max, row.longest_wait_ms, row.never_ran);
  std::string text = line.str();
  text.pop_back();
  return text;
}

}  // namespace hotpath::sweep
