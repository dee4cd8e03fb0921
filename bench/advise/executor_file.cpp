// SPDX-License-Identifier: Apache-2.0
#include "advise/executor_file.hpp"

#include "hotpath/reference_system/graph_writer.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::advise {

std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets,
                                              const std::filesystem::path& folder) {
  if (candidate.spec.deployment || candidate.spec.entry->traits.family == Family::wait_set) return {};
  Graph graph = candidate.graph;
  graph.platform = platform;
  const std::string priorities = candidate.sets_priorities ? "With the priorities that executor.yaml needs."
                                                           : "The graph of executor.yaml.";
  write_graph(folder / "graph.yaml", graph, {priorities, {}}, program::write_with_folder);

  const ExecutorEntry& entry = *candidate.spec.entry;
  const SchedulerOptions& scheduler = candidate.spec.scheduler;
  std::string text =
      "# Options of hotpath_rclcpp's PriorityExecutor, for each process of the system:\n"
      "# PriorityExecutorOptions::from_file(), or the parameter `config` of\n"
      "# component_container_hotpath. Paths are relative to this file.\n";
  text += program::concat("executor: ", entry.name);
  if (entry.traits.family == Family::priority_events) {
    if (scheduler.rule != SubscriptionRule::inherit) text += program::concat(":", to_string(scheduler.rule));
    if (scheduler.ties != Ties::lifo) text += program::concat(":", to_string(scheduler.ties));
  }
  text += program::concat("\nthreads: ", candidate.threads, "\ngraph: graph.yaml\n");
  // PriorityExecutor's default is not that of graphs: 0 states that the prediction has no such rule.
  if (entry.traits.family == Family::priority_events)
    text += program::text("service_wait_ms: %.15g\n", to_ms(scheduler.guaranteed_wait));
  if (!offsets.empty()) text += "offsets: " + offsets + "\n";
  program::write_whole_file(folder / "executor.yaml", text);
  return {folder / "graph.yaml", folder / "executor.yaml"};
}

}  // namespace hotpath::advise
