// SPDX-License-Identifier: Apache-2.0
#include "advise/advice_files.hpp"

#include <algorithm>
#include <iterator>

#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::advise {

namespace fs = std::filesystem;

using program::concat, program::text;

namespace {

/// PriorityExecutor's default.
constexpr Duration kServiceWait = std::chrono::milliseconds(100);

}  // namespace

std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets, const fs::path& folder) {
  const std::span<const setup::ExecutorSpec> parts = setup::parts(candidate.spec);
  const setup::ExecutorSpec& executor = parts.front();
  const auto differs = [&](const setup::ExecutorSpec& part) { return part.label != executor.label; };
  if (executor.entry->traits.family == Family::wait_set || std::ranges::any_of(parts, differs)) return {};
  Graph graph = candidate.graph;
  graph.platform = platform;
  const std::string priorities = candidate.sets_priorities ? "With the priorities that executor.yaml needs."
                                                           : "The graph of executor.yaml.";
  write_graph(folder / "graph.yaml", graph, {priorities, {}}, program::write_with_folder);

  const SchedulerOptions& scheduler = executor.scheduler;
  const bool queue = executor.entry->traits.family == Family::priority_events;
  std::string options = concat(
      "# Options of hotpath_rclcpp's PriorityExecutor, for each process of the system:\n"
      "# PriorityExecutorOptions::from_file(), or the parameter `config` of\n"
      "# component_container_hotpath. Paths are relative to this file.\n",
      "executor: ", setup::name_with_rules(*executor.entry, scheduler),
      "\nthreads: ", candidate.load.threads / parts.size(), "\ngraph: graph.yaml\n");
  // Of graphs, the default is 0; a robot whose graph states none has services of parameters all the same.
  const bool stated = scheduler.service_wait > Duration::zero();
  if (queue)
    options += text("service_wait_ms: %.15g\n", to_ms(stated ? scheduler.service_wait : kServiceWait));
  if (!offsets.empty()) options += "offsets: " + offsets + "\n";
  program::write_whole_file(folder / "executor.yaml", options);
  return {folder / "graph.yaml", folder / "executor.yaml"};
}

std::string installation(const fs::path& folder, const fs::path& shown) {
  if (!fs::exists(folder / "executor.yaml")) return "";
  const std::string file = shown / "executor.yaml";
  return concat(R"(
Install it in one of three ways:

1. In C++; in CMake with find_package(hotpath_rclcpp REQUIRED) and the target hotpath_rclcpp::hotpath_rclcpp:

#include <hotpath_rclcpp/priority_executor.hpp>

hotpath::PriorityExecutor executor{hotpath::PriorityExecutorOptions::from_file(")",
                file, R"(")};
executor.add_node(node);
executor.spin();

2. In a launch file, for nodes of a component container:

from launch_ros.actions import ComposableNodeContainer

container = ComposableNodeContainer(
    name="container", namespace="", package="hotpath_rclcpp", executable="component_container_hotpath",
    parameters=[{"config": ")",
                file, R"("}], composable_node_descriptions=[])

3. In the shell, where hotpath_rclcpp is sourced, before a program that calls rclcpp::spin(node):

export LD_PRELOAD=libhotpath_rclcpp_spin.so HOTPATH_EXECUTOR=)",
                file, "\n");
}

std::string write_change(const Candidate& c, const Graph& graph, const fs::path& folder) {
  Deployment plan = c.spec.deployment ? c.spec.deployment->plan : find_deployment("single", graph, c.tasks);
  if (!c.spec.deployment) plan.executors.front().executor = c.executor();
  plan.name = "advice";
  plan.description = c.description;
  program::write_whole_file(folder / "deployment.yaml", deployment_yaml(c.graph, c.tasks, plan));
  (void)write_executor_files(c, graph.platform, "", folder);
  return folder / "deployment.yaml";
}

std::string store_first_draw(const Candidate& candidate, const setup::CommonOptions& options,
                             const fs::path& folder) {
  program::create_folder(folder);
  simulated::Options o;
  static_cast<setup::CommonOptions&>(o) = options;
  o.graph = folder / "graph.yaml";
  write_graph(o.graph, with_drawn_deliveries(candidate.graph, options.seed),
              {"The graph of one candidate, with the candidate's costs.", {}}, program::write_with_folder);
  o.load_given = o.rate_percent = std::nullopt;
  o.copies = o.repetitions = o.threads = 1;
  o.set.clear();
  o.executors.clear();
  o.deployments.clear();
  std::string label = candidate.executor();
  if (candidate.spec.deployment) {
    Deployment plan = candidate.spec.deployment->plan;
    plan.name = candidate.name;
    o.deployments = {folder / "deployment.yaml"};
    program::write_whole_file(o.deployments.front(), deployment_yaml(candidate.graph, candidate.tasks, plan));
  } else {
    o.executors = {label};
  }
  o.output = folder / "run";
  o.command.clear();
  simulated::store_simulation(o);
  return label;
}

results::SampleRows write_latencies(const fs::path& file, const std::vector<Prediction>& predictions,
                                    std::size_t chain) {
  results::SampleRows all;
  program::write_whole_file(file, [&](std::ostream& out) {
    out << kChainsCsvHeader << "\n";
    for (const Prediction& p : predictions) {
      for (const results::Repetition& draw : p.draws) {
        if (!p.keeps_up()) continue;
        Trace trace;
        trace.executor = p.candidate->name;
        trace.repetition = draw.trace.repetition;
        std::ranges::copy_if(draw.trace.chains, std::back_inserter(trace.chains),
                             [&](const ChainRecord& r) { return r.chain == chain; });
        const std::vector<std::string> names = setup::chain_names(p.candidate->graph);
        write_chains_csv(out, p.candidate->tasks.set, names, trace);
        if (trace.chains.empty()) continue;
        all.push_back(
            {{"name", names[chain]}, {"executor", trace.executor}, {"repetition", trace.repetition}});
        for (const ChainRecord& output : trace.chains) results::add(all.back(), output);
      }
    }
  });
  return all;
}

}  // namespace hotpath::advise
