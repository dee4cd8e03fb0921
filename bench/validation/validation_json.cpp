// SPDX-License-Identifier: Apache-2.0
#include "validation/validation_json.hpp"

#include <nlohmann/json.hpp>

namespace hotpath {

namespace {

using nlohmann::json;

json quantiles_json(const Quantiles& q) {
  return {{"n", q.n}, {"p50", q.p50}, {"p90", q.p90}, {"p99", q.p99}, {"max", q.max}};
}

/// `first` and `second` name the two sides in keys.
json comparison_json(const ScheduleComparison& c, const std::string& first, const std::string& second) {
  json tasks = json::array();
  for (const TaskComparison& t : c.tasks) {
    tasks.push_back({{"task", t.task},
                     {first + "_lost_percent", t.lost_percent[0]},
                     {second + "_lost_percent", t.lost_percent[1]}});
  }
  const auto both = [&](const Quantiles(&q)[2]) {
    return json{{first, quantiles_json(q[0])}, {second, quantiles_json(q[1])}};
  };
  json j = {{"jobs", {{first, c.jobs[0]}, {second, c.jobs[1]}}},
            {"similarity", c.similarity},
            {"similarity_by_period", c.similarity_by_period},
            {"first_difference", nullptr},
            {"largest_loss_difference_percent", c.largest_loss_difference()},
            {"tasks", tasks},
            {"start_lateness_ms", both(c.lateness_ms)},
            {"response_ms", both(c.response_ms)},
            {"response_authors_ms", both(c.response_authors_ms)}};
  if (c.first_difference) {
    j["first_difference"] = {{"place", c.first_difference->place},
                             {"at_ms", to_ms(c.first_difference->at - Time{})},
                             {first, c.first_difference->task[0]},
                             {second, c.first_difference->task[1]}};
  }
  return j;
}

json latency_json(const LatencyQuantiles& q) {
  json j = {{"p10", q.p10}, {"p50", q.p50}, {"p90", q.p90}, {"p99", q.p99}, {"max", q.max}};
  if (q.n) j["n"] = *q.n;
  return j;
}

json golden_json(const GoldenValidation& v) {
  return {{"set", v.set},
          {"executor", v.executor},
          {"dispatch_cost_us", to_us(v.costs.dispatch_cost)},
          {"wake_up_us", to_us(v.costs.wake_up_latency)},
          {"without_costs", comparison_json(v.without_costs, "measured", "simulated")},
          {"with_costs", comparison_json(v.with_costs, "measured", "simulated")},
          {"verdict", v.verdict}};
}

json ranges_json(const TimersOnlyRanges& r) {
  const auto ends = [](const Range& range) { return json::array({range.low, range.high}); };
  return {{"imu_lost_percent", ends(r.imu_lost_percent)},
          {"response_authors_p50_ms", ends(r.response_authors_p50_ms)},
          {"response_authors_p99_ms", ends(r.response_authors_p99_ms)}};
}

json timers_only_json(const TimersOnlyValidation& v) {
  return {{"set", v.set},
          {"executor", v.executor},
          {"measured", ranges_json(v.measured)},
          {"simulated", ranges_json(v.simulated)},
          {"verdict", v.verdict}};
}

json autoware_json(const AutowareValidation& v) {
  return {{"executor", v.executor},
          {"measured_ms", latency_json(v.measured)},
          {"simulated_ms", latency_json(v.simulated)},
          {"verdict", v.verdict}};
}

json run_json(const RunValidation& v) {
  json j = {{"run", v.run},
            {"executor", v.executor},
            {"repetition", v.repetition},
            {"comparison", comparison_json(v.comparison, "measured", "simulated")},
            {"verdict", v.verdict}};
  if (v.latencies) {
    j["measured_ms"] = latency_json(v.latencies->run);
    j["simulated_ms"] = latency_json(v.latencies->simulated);
    if (v.latencies->real) {
      j["real_ms"] = latency_json(*v.latencies->real);
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
  return j;
}

json rows(const auto& results, auto to_row) {
  json all = json::array();
  for (const auto& result : results) all.push_back(to_row(result));
  return all;
}

}  // namespace

json to_json(const Validation& v) {
  return {{"kind", "validation"},
          {"version", HOTPATH_VERSION},
          {"golden", rows(v.golden, golden_json)},
          {"timers_only", rows(v.timers_only, timers_only_json)},
          {"autoware", rows(v.autoware, autoware_json)},
          {"runs", rows(v.runs, run_json)}};
}

}  // namespace hotpath
