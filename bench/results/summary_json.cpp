// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "results/summary.hpp"

namespace hotpath {

using nlohmann::json;

json quantiles_json(const Quantiles& q) {
  return {{"n", q.n},     {"min", q.min},   {"p50", q.p50}, {"p90", q.p90},
          {"p99", q.p99}, {"p999", q.p999}, {"max", q.max}, {"mean", q.mean}};
}

namespace {

json interval_json(const std::optional<Interval>& interval) {
  return interval ? json::array({interval->low, interval->high}) : json(nullptr);
}

json latency_json(const LatencySummary& latency) {
  json j = quantiles_json(latency.quantiles);
  j["interval"] = {{"p50", interval_json(latency.p50)},
                   {"p99", interval_json(latency.p99)},
                   {"p999", interval_json(latency.p999)},
                   {"max", interval_json(latency.max)}};
  return j;
}

json estimate_json(const std::optional<Estimate>& estimate) {
  if (!estimate) return nullptr;
  return {{"value", estimate->value}, {"interval", interval_json(estimate->interval)}};
}

json chain_json(const ChainSummary& chain) {
  return {
      {"chain", chain.chain},
      {"hot_path_latency_ms", latency_json(chain.hot_path)},
      {"end_to_end_latency_ms", latency_json(chain.end_to_end)},
      {"hot_path_drops", chain.drops},
      {"ratio_to_default",
       {{"median", estimate_json(chain.median_to_default)}, {"max", estimate_json(chain.max_to_default)}}},
      {"difference_to_default_ms", {{"median", estimate_json(chain.median_minus_default)}}}};
}

json counts_json(const TimerCounts& counts) {
  return {{"reached", counts.reached},
          {"ran", counts.ran},
          {"skipped", counts.skipped},
          {"dropped_percent", counts.dropped_percent()},
          {"deadline_overruns", counts.deadline_overruns}};
}

json task_json(const TaskSummary& task) {
  const bool timer = task.kind == TaskKind::timer;
  json j = {{"task", task.task},       {"kind", timer ? "timer" : "subscription"},
            {"ran", task.ran},         {"queued", task.queued},
            {"running", task.running}, {"response_ms", quantiles_json(task.response_ms)}};
  if (timer) {
    j["skipped"] = task.skipped;
    j["deadline_ms"] = to_ms(task.deadline);
    j["deadline_overruns"] = task.after_warm_up.deadline_overruns;
    j["after_warm_up"] = counts_json(task.after_warm_up);
  } else {
    j["overwritten"] = task.overwritten;
    j["empty"] = task.empty;
  }
  if (task.response_authors_ms) j["response_authors_ms"] = quantiles_json(*task.response_authors_ms);
  if (task.period_ms) j["period_ms"] = quantiles_json(*task.period_ms);
  return j;
}

json executor_json(const ExecutorSummary& executor) {
  json chains = json::array(), tasks = json::array(), unbalanced = json::array();
  for (const ChainSummary& chain : executor.chains) chains.push_back(chain_json(chain));
  for (const TaskSummary& task : executor.tasks) tasks.push_back(task_json(task));
  for (const Imbalance& i : executor.unbalanced) {
    unbalanced.push_back({{"repetition", i.repetition},
                          {"task", i.task},
                          {"accounted", i.accounted},
                          {"expected", i.expected}});
  }
  return {{"executor", executor.executor},
          {"repetitions", executor.repetitions},
          {"callbacks_executed", executor.executed},
          {"skipped", executor.skipped},
          {"overwritten", executor.overwritten},
          {"deadline_overruns", executor.after_warm_up.deadline_overruns},
          {"after_warm_up", counts_json(executor.after_warm_up)},
          {"lost_records", executor.lost_records},
          {"cpu_per_callback_us", executor.cpu_per_callback_us},
          {"usage", to_json(executor.usage)},
          {"chains", std::move(chains)},
          {"tasks", std::move(tasks)},
          {"loss_equations", {{"hold", executor.unbalanced.empty()}, {"unbalanced", std::move(unbalanced)}}}};
}

}  // namespace

nlohmann::json to_json(const Summary& summary) {
  json executors = json::array();
  for (const ExecutorSummary& executor : summary.executors) executors.push_back(executor_json(executor));
  return {{"warm_up_s", to_ms(summary.warm_up) / 1e3},
          {"bootstrap",
           {{"confidence", summary.bootstrap.confidence},
            {"resamples", summary.bootstrap.resamples},
            {"seed", summary.bootstrap.seed}}},
          {"executors", std::move(executors)}};
}

}  // namespace hotpath
