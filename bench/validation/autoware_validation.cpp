// SPDX-License-Identifier: Apache-2.0
#include "validation/autoware_validation.hpp"

#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "validation/prediction.hpp"

namespace hotpath {

using namespace std::chrono_literals;

std::vector<AutowareValidation> validate_autoware(const std::filesystem::path& reference) {
  Graph graph = load_graph(find_graph("autoware"));
  for (Node& node : graph.nodes) {
    if (node.execution_time > Duration{}) node.execution_time = node.best_case_execution_time = 4220us;
  }
  const std::filesystem::path file = reference / "rclcpp_autoware_phases.csv";
  std::vector<AutowareValidation> all;
  for (CsvReader row(file); row.next();) {
    const std::string label(row.text("executor"));
    const std::string name = label.substr(0, label.find(' '));
    GraphTasks tasks = make_tasks(graph);
    const auto first = read_phases(file, graph, name);
    for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
    // Subscriptions before timers, and of two equals the earlier first, as the fork's heap has it.
    const ExecutorSpec executor = parse_executor(name, {SubscriptionRule::first, Ties::fifo, 2});
    SimulationOptions options;
    options.platform = reference_platform(*executor.entry);
    options.duration = 30s;
    const WorstCaseTimes times(tasks.set);
    // The six outputs of a hyperperiod (600 ms) differ: a whole number of them counts.
    const Prediction p = predict(graph, tasks, executor, times, options, 1200ms);
    AutowareValidation v{label, real_latencies(row), latency_quantiles(p.latencies_ms.at(0)), ""};
    v.verdict =
        median_verdict(v.measured, v.simulated, executor.entry->traits.many_workers ? 0.10 : 0.05,
                       "six outputs alternate, and costs decide which of two crunch counts the median "
                       "falls on");
    all.push_back(std::move(v));
  }
  return all;
}

}  // namespace hotpath
