// SPDX-License-Identifier: Apache-2.0
#include "setup/setup_facts.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/text.hpp"
#include "results/stored_run.hpp"
#include "setup/deployed_system.hpp"
#include "setup/revision.hpp"

namespace hotpath::setup {

namespace {

results::DeploymentRecord record_of(const ExecutorSpec& spec, const TaskSet& set) {
  results::DeploymentRecord record{spec.label, spec.plan.file, {}};
  for (const ExecutorSpec& part : parts(spec))
    record.executors.push_back(
        {part.place, part.first_worker, worker_count(*part.entry, part.scheduler), {}});
  for (TaskId id = 0; id < set.size(); ++id)
    record.executors[executor_of(spec, id)].tasks.push_back(set[id].name);
  return record;
}

}  // namespace

results::RunRecord record_of(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                             const std::vector<ExecutorSpec>& executors) {
  results::RunRecord record;
  static_cast<results::RunOptions&>(record) = options;
  record.version = HOTPATH_VERSION;
  record.revision = kRevision;
  record.graph = {graph.name, graph.nodes.size(), options.graph};
  record.tasks = set;
  record.chains = chain_names(graph);
  const double load = load_percent(graph);
  record.load_percent = std::round(load * 1000) / 1000;
  record.work = graph.work;
  for (const ExecutorSpec& e : executors) {
    record.executors.push_back(e.label);
    if (!e.entry) record.deployments[e.label] = record_of(e, set);
  }
  record.entity_order = options.entity_order.text();
  record.entity_tasks.clear();
  if (!executors.empty()) {
    for (const TaskId id : executors.front().scheduler.entity_order)
      record.entity_tasks.push_back(set[id].name);
  }
  record.phases = options.phases_of.empty() ? to_string(options.phases) : "as in " + options.phases_of;
  if (!graph.chains.empty() && load > 0) {
    const ChainLimits limits = chain_limits(graph, graph.chains.front());
    record.limits = {{"computation of the longest branch", limits.one_core_per_branch},
                     {"computation of all branches", limits.one_thread}};
  }
  return record;
}

void keep_inputs(const results::RunFolder& folder, const CommonOptions& options, const Graph& graph,
                 results::RunRecord& record, const std::string& times) {
  record.inputs.clear();
  const std::filesystem::path file = find_graph(options.graph);
  std::set<std::filesystem::path> values;  // files of execution times, which the copy finds beside itself
  for (const Node& node : graph.nodes) {
    for (const Callback& callback : node.callbacks) {
      if (!callback.measured_file.empty()) values.insert(callback.measured_file);
    }
  }
  const auto is_below = [](const std::filesystem::path& path) {
    return path.is_absolute() || *path.lexically_normal().begin() != "..";
  };
  if (std::ranges::all_of(values, is_below)) {
    keep_input(folder, record, "graph", file);
    for (const auto& path : values) {
      if (!path.is_absolute()) keep_input(folder, record, "values", file.parent_path() / path, path);
    }
  }
  std::size_t n = 0;
  for (const auto& [label, deployment] : record.deployments) {
    if (!deployment.file.empty() && std::filesystem::exists(deployment.file))
      keep_input(folder, record, program::concat("deployment_", ++n), deployment.file);
  }
  if (!times.empty()) keep_input(folder, record, "times", times);
}

std::vector<std::string> idle_options(const CommonOptions& options,
                                      const std::vector<ExecutorSpec>& executors) {
  const auto waits = [](const ExecutorSpec& part) { return part.entry->traits.family == Family::wait_set; };
  const bool any = std::ranges::any_of(
      executors, [&](const ExecutorSpec& spec) { return std::ranges::any_of(parts(spec), waits); });
  std::vector<std::string> sentences;
  if (!any && options.entity_order != EntityOrder{})
    sentences.emplace_back("--entity-order changes nothing: none of these executors has a wait set");
  return sentences;
}

std::vector<results::BoundRecord> timer_bounds(const Graph& graph, const GraphTasks& tasks,
                                               const std::vector<ExecutorSpec>& executors) {
  std::vector<results::BoundRecord> bounds;
  if (!results::timers_only(tasks.set)) return bounds;
  for (const ExecutorSpec& executor : executors) {
    const auto all = executor.entry ? guarantees(graph, tasks, executor) : std::nullopt;
    for (TaskId id = 0; all && id < tasks.set.size(); ++id) {
      if (const auto bound = all->of(Latency::response, tasks.set[id].name))
        bounds.push_back({executor.label, tasks.set[id].name, Duration(bound->ns), bound->method});
    }
  }
  return bounds;
}

}  // namespace hotpath::setup
