// SPDX-License-Identifier: Apache-2.0
#include "program/json_fields.hpp"
#include "validation/validation.hpp"

namespace hotpath {

using nlohmann::json;

namespace {

json quantiles_json(const Quantiles& q) {
  return {{"n", q.n}, {"p50", q.p50}, {"p90", q.p90}, {"p99", q.p99}, {"max", q.max}};
}

/// `first` and `second` name the two sides in keys.
json comparison_json(const ScheduleComparison& c, const std::string& first, const std::string& second) {
  const auto both = [&](const Quantiles(&q)[2]) {
    return json{{first, quantiles_json(q[0])}, {second, quantiles_json(q[1])}};
  };
  json j = {{"jobs", {{first, c.jobs[0]}, {second, c.jobs[1]}}},
            {"similarity", c.similarity},
            {"similarity_by_period", c.similarity_by_period},
            {"first_difference", nullptr},
            {"largest_loss_difference_percent", c.largest_loss_difference()},
            {"tasks", json::array()},
            {"start_lateness_ms", both(c.lateness_ms)},
            {"response_ms", both(c.response_ms)},
            {"response_authors_ms", both(c.response_authors_ms)}};
  for (const TaskComparison& t : c.tasks) {
    j["tasks"].push_back({{"task", t.task},
                          {first + "_lost_percent", t.lost_percent[0]},
                          {second + "_lost_percent", t.lost_percent[1]}});
  }
  if (c.first_difference) {
    j["first_difference"] = {{"place", c.first_difference->place},
                             {"at_ms", to_ms(c.first_difference->at - Time{})},
                             {first, c.first_difference->task[0]},
                             {second, c.first_difference->task[1]}};
  }
  return j;
}

}  // namespace

// The library finds these by their argument, also for the elements of vectors.

static HOTPATH_JSON_FIELDS(TimersOnlyRanges, imu_lost_percent, response_authors_p50_ms,
                           response_authors_p99_ms);
static HOTPATH_JSON_FIELDS(TimersOnlyValidation, set, executor, measured, simulated, verdict);

static void to_json(json& j, const LatencyQuantiles& q) {
  j = {{"p10", q.p10}, {"p50", q.p50}, {"p90", q.p90}, {"p99", q.p99}, {"max", q.max}};
  if (q.n) j["n"] = *q.n;
}

static void to_json(json& j, const GoldenValidation& v) {
  j = {{"set", v.set},
       {"executor", v.executor},
       {"dispatch_cost_us", to_us(v.costs.dispatch_cost)},
       {"wait_cost_us", to_us(v.costs.wait_cost)},
       {"wait_cost_per_entity_us", to_us(v.costs.wait_cost_per_entity)},
       {"wake_up_us", to_us(v.costs.wake_up_latency)},
       {"without_costs", comparison_json(v.without_costs, "measured", "simulated")},
       {"with_costs", comparison_json(v.with_costs, "measured", "simulated")},
       {"verdict", v.verdict}};
}

static void to_json(json& j, const AutowareValidation& v) {
  j = {{"executor", v.executor},
       {"measured_ms", v.measured},
       {"simulated_ms", v.simulated},
       {"verdict", v.verdict}};
}

static void to_json(json& j, const RunValidation& v) {
  j = {{"run", v.run},
       {"executor", v.executor},
       {"repetition", v.repetition},
       {"comparison", comparison_json(v.comparison, "measured", "simulated")},
       {"verdict", v.verdict}};
  if (v.latencies) {
    j["measured_ms"] = v.latencies->run;
    j["simulated_ms"] = v.latencies->simulated;
    if (v.latencies->real) {
      j["real_ms"] = *v.latencies->real;
      j["phases_differ_ms"] = *v.latencies->phases_differ_ms;
    }
  }
  if (const auto& g = v.golden) {
    j["golden"] = {{"set", g->set},
                   {"phases_differ_ms", g->phases_differ_ms},
                   {"busy_percent", {{"real", g->real_busy_percent}, {"live", g->run_busy_percent}}},
                   {"comparison", comparison_json(g->comparison, "real", "live")},
                   {"verdict", g->verdict}};
  }
}

void to_json(json& j, const Validation& v) {
  j = {{"kind", "validation"},         {"version", HOTPATH_VERSION}, {"golden", v.golden},
       {"timers_only", v.timers_only}, {"autoware", v.autoware},     {"runs", v.runs}};
}

}  // namespace hotpath
