// SPDX-License-Identifier: Apache-2.0
#include "validation/validation_parts.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath {

namespace {

using nlohmann::json;

constexpr double kSimilar = 0.98;

json quantiles_json(const Quantiles& q) {
  return {{"n", q.n}, {"p50", q.p50}, {"p90", q.p90}, {"p99", q.p99}, {"max", q.max}};
}

}  // namespace

bool agrees(const ScheduleComparison& c) {
  return c.similarity >= kSimilar && c.largest_loss_difference() <= kSameLoss_percent;
}

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

json latency_json(std::vector<double> samples) {
  std::sort(samples.begin(), samples.end());
  json j = quantiles_json(quantiles(samples));
  j["p10"] = quantile(samples, 0.1);
  return j;
}

json real_latency_json(const CsvReader& row) {
  return {{"p10", row.number<double>("hot_path_p10_ms")},
          {"p50", row.number<double>("hot_path_p50_ms")},
          {"p90", row.number<double>("hot_path_p90_ms")},
          {"p99", row.number<double>("hot_path_p99_ms")},
          {"max", row.number<double>("hot_path_max_ms")}};
}

std::string median_verdict(double measured, double simulated, double tolerance,
                           const std::string& otherwise) {
  const double percent = 100 * (simulated / measured - 1);
  if (std::abs(percent) <= 100 * tolerance) return text("the median agrees (%+.1f %%)", percent);
  return text("the median is %+.1f %% off: ", percent) + otherwise;
}

Prediction predict(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec& executor,
                   const ExecutionTimes& times, const SimulationOptions& options, Duration warm_up) {
  std::vector<ChainObservation> observations;
  GraphWorkload workload(graph, tasks, times, &observations);
  Prediction p;
  p.trace = simulate_trace(tasks.set, *executor.entry, executor.scheduler, workload, options);
  p.latencies_ms.resize(graph.chains.size());
  for (const ChainObservation& o : observations) {
    if (o.sink_start < Time{} + warm_up) continue;
    p.latencies_ms[o.chain].push_back(to_ms(o.sink_start - o.latest_source_start));
  }
  return p;
}

}  // namespace hotpath
