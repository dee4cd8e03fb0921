// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"
#include "results/summary_table.hpp"

// nlohmann's library finds these functions by argument-dependent lookup, also for elements of
// vectors and optionals: each stands in the namespace of its type.

namespace hotpath {

void to_json(nlohmann::json& j, const Interval& interval) { j = {interval.low, interval.high}; }

HOTPATH_FIELDS(BootstrapOptions, confidence, resamples, seed);

void to_json(nlohmann::json& j, const Quantiles& quantiles) {
  j = {{"n", quantiles.n}, {"mean", quantiles.mean}};
  for (const QuantileTraits& traits : kQuantiles) j[traits.key] = quantiles.*traits.of;
}

}  // namespace hotpath

namespace hotpath::results {

using nlohmann::json;

static void to_json(json& j, const LatencySummary& latency) {
  j = latency.quantiles;
  for (const QuantileTraits& traits : kQuantiles) {
    if (traits.has_interval) j["interval"][traits.key] = latency.estimate(traits.of).interval;
  }
}

static void to_json(json& j, const ChainSummary& chain) {
  const LatencySummary &hot_path = chain.hot_path, &age = chain.end_to_end;
  j = {{"chain", chain.chain},
       {"hot_path_latency_ms", hot_path},
       {"end_to_end_latency_ms", age},
       {"hot_path_drops", chain.drops},
       {"ratio_to_default", {{"median", hot_path.median_to_default}, {"max", hot_path.max_to_default}}},
       {"difference_to_default_ms", {{"median", hot_path.median_minus_default}}},
       {"end_to_end_ratio_to_default",
        {{"median", age.median_to_default}, {"p99", age.p99_to_default}, {"max", age.max_to_default}}},
       {"output_interval_ms", chain.interval_ms},
       {"disparity_ms", chain.disparity_ms}};
}

static void to_json(json& j, const ExecutorSummary& part) {
  program::JsonFields visit(j);
  HOTPATH_VISIT(executor, repetitions, skipped, overwritten, after_warm_up, lost_records, cpu_per_callback_us,
                usage, chains, tasks, disturbed, overload)
  visit("callbacks_executed", part.executed);
  visit("losses", part.each);
  visit("deadline_overruns", part.after_warm_up.deadline_overruns);
  visit("starved", starved(part));
  j["loss_equations"] = {{"hold", part.unbalanced.empty()}, {"unbalanced", part.unbalanced}};
}

void to_json(json& j, const Summary& summary) {
  j = {{"version", HOTPATH_VERSION},
       {"warm_up_s", to_ms(summary.warm_up) / 1e3},
       {"bootstrap", summary.bootstrap},
       {"verdict", verdict(summary)},
       {"executors", summary.executors}};
}

}  // namespace hotpath::results
