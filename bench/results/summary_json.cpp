// SPDX-License-Identifier: Apache-2.0
#include "program/json_fields.hpp"
#include "results/summary.hpp"

// nlohmann's library finds these functions by argument-dependent lookup, also for elements of
// vectors and optionals: each stands in the namespace of its type.

namespace hotpath {

static void to_json(nlohmann::json& j, const Interval& interval) { j = {interval.low, interval.high}; }

HOTPATH_JSON_FIELDS(Estimate, value, interval);
HOTPATH_JSON_FIELDS(Quantiles, n, min, p50, p90, p99, p999, max, mean);
static HOTPATH_JSON_FIELDS(BootstrapOptions, confidence, resamples, seed);

}  // namespace hotpath

namespace hotpath::results {

using nlohmann::json;

static HOTPATH_JSON_FIELDS(RepetitionMeasures, repetition, skipped, overwritten);
static HOTPATH_JSON_FIELDS(DisturbedRepetition, repetition, marks);
static HOTPATH_JSON_FIELDS(Imbalance, repetition, task, accounted, expected);

static void to_json(json& j, const LatencySummary& latency) {
  j = latency.quantiles;
  j["interval"] = {{"p50", latency.p50}, {"p99", latency.p99}, {"p999", latency.p999}, {"max", latency.max}};
}

static void to_json(json& j, const ChainSummary& chain) {
  j = {{"chain", chain.chain},
       {"hot_path_latency_ms", chain.hot_path},
       {"end_to_end_latency_ms", chain.end_to_end},
       {"hot_path_drops", chain.drops},
       {"ratio_to_default", {{"median", chain.median_to_default}, {"max", chain.max_to_default}}},
       {"difference_to_default_ms", {{"median", chain.median_minus_default}}}};
}

static void to_json(json& j, const TimerCounts& counts) {
  j = {{"reached", counts.reached},
       {"ran", counts.ran},
       {"skipped", counts.skipped},
       {"dropped_percent", counts.dropped_percent()},
       {"deadline_overruns", counts.deadline_overruns}};
}

static void to_json(json& j, const TaskSummary& task) {
  const bool timer = task.kind == TaskKind::timer;
  j = {{"task", task.task},
       {"kind", to_string(task.kind)},
       {"response_ms", task.response_ms},
       {"longest_wait_ms", to_ms(task.longest_wait)},
       {"never_ran", task.never_ran()}};
  for (const auto& [outcome, name] : enum_texts(Outcome{})) {
    const bool of_timers = outcome == Outcome::skipped;
    const bool of_subscriptions = outcome == Outcome::overwritten || outcome == Outcome::empty;
    if (timer ? !of_subscriptions : !of_timers) j[name] = task.account[outcome];
  }
  if (timer) {
    j["deadline_ms"] = to_ms(task.deadline);
    j["deadline_overruns"] = task.after_warm_up.deadline_overruns;
    j["after_warm_up"] = task.after_warm_up;
  }
  if (task.response_authors_ms) j["response_authors_ms"] = task.response_authors_ms;
  if (task.period_ms) j["period_ms"] = task.period_ms;
  if (task.period_deviation_ms) j["period_deviation_ms"] = task.period_deviation_ms;
}

static void to_json(json& j, const ExecutorSummary& executor) {
  j = {{"executor", executor.executor},
       {"repetitions", executor.repetitions},
       {"callbacks_executed", executor.executed},
       {"skipped", executor.skipped},
       {"overwritten", executor.overwritten},
       {"losses", executor.each},
       {"deadline_overruns", executor.after_warm_up.deadline_overruns},
       {"after_warm_up", executor.after_warm_up},
       {"lost_records", executor.lost_records},
       {"cpu_per_callback_us", executor.cpu_per_callback_us},
       {"usage", executor.usage},
       {"chains", executor.chains},
       {"tasks", executor.tasks},
       {"disturbed", executor.disturbed},
       {"loss_equations", {{"hold", executor.unbalanced.empty()}, {"unbalanced", executor.unbalanced}}}};
}

void to_json(json& j, const Summary& summary) {
  j = {{"warm_up_s", to_ms(summary.warm_up) / 1e3},
       {"bootstrap", summary.bootstrap},
       {"executors", summary.executors}};
}

}  // namespace hotpath::results
