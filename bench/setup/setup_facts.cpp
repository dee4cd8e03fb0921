// SPDX-License-Identifier: Apache-2.0
#include "setup/setup_facts.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "bounds/bounds.hpp"
#include "hotpath/reference_system/chain_limits.hpp"
#include "hotpath/reference_system/graph_scaling.hpp"
#include "results/run_facts.hpp"

namespace hotpath {

using nlohmann::json;

namespace {

json deployment_json(const ExecutorSpec& spec, const TaskSet& set) {
  json executors = json::array();
  const Deployment& plan = spec.deployment->plan;
  std::uint32_t first = 0;
  for (std::size_t e = 0; e < plan.executors.size(); ++e) {
    const DeployedExecutor& executor = plan.executors[e];
    json tasks = json::array();
    for (TaskId id = 0; id < set.size(); ++id) {
      if (plan.executor_of[id] == e) tasks.push_back(set[id].name);
    }
    const ExecutorSpec& part = spec.deployment->executors[e];
    const std::uint32_t workers = worker_count(*part.entry, part.scheduler);
    executors.push_back({{"name", executor.name},
                         {"executor", executor.executor},
                         {"policy", to_string(executor.policy)},
                         {"processors", executor.processors},
                         {"process", executor.process},
                         {"first_worker", first},
                         {"workers", workers},
                         {"tasks", tasks}});
    first += workers;
  }
  return {{"name", plan.name}, {"file", plan.file}, {"executors", executors}};
}

}  // namespace

json common_facts(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                  const std::vector<ExecutorSpec>& executors) {
  json deployments = json::object();
  std::vector<std::string> labels;
  for (const ExecutorSpec& e : executors) {
    labels.push_back(e.label);
    if (e.deployment) deployments[e.label] = deployment_json(e, set);
  }
  json limits = json::array();
  const double load = load_percent(graph);
  if (!graph.chains.empty() && load > 0) {
    const ChainLimits l = chain_limits(graph, graph.chains.front());
    limits = {{{"label", "limit with one core per branch"}, {"ms", to_ms(l.one_core_per_branch)}},
              {{"label", "limit on one thread"}, {"ms", to_ms(l.one_thread)}}};
  }
  json facts = {{"complete", false},
                {"partial", false},
                {"version", HOTPATH_VERSION},
                {"graph", {{"name", graph.name}, {"nodes", graph.nodes.size()}, {"file", options.graph}}},
                {"tasks", tasks_json(set)},
                {"chains", chain_names(graph)},
                {"executors", labels},
                {"deployments", deployments},
                {"rule", to_string(options.rule)},
                {"ties", to_string(options.ties)},
                {"entity_order", options.entity_order},
                {"repetitions", options.repetitions},
                {"duration_s", options.duration_s},
                {"warm_up_s", options.warm_up_s},
                {"seed", options.seed},
                {"phases", to_string(options.phases)},
                {"load_percent", std::round(load * 1000) / 1000},
                {"load_given", options.load_percent ? json(*options.load_percent) : json()},
                {"work", to_string(graph.work)},
                {"limits", limits},
                {"runs", json::array()},
                {"warnings", json::array()},
                {"failures", json::array()}};
  if (options.rate_percent) facts["rate_percent"] = *options.rate_percent;
  if (options.copies > 1) facts["copies"] = options.copies;
  if (!executors.empty()) {
    for (const TaskId id : executors.front().scheduler.entity_order) {
      facts["entity_tasks"].push_back(set[id].name);
    }
  }
  if (!options.phases_file.empty()) facts["phases_file"] = options.phases_file;
  if (options.phase_step_ms) facts["phase_step_ms"] = *options.phase_step_ms;
  if (!options.command.empty()) facts["command"] = options.command;
  return facts;
}

std::vector<std::string> idle_options(const CommonOptions& options,
                                      const std::vector<ExecutorSpec>& executors) {
  const auto none = [&](Family family) {
    const auto is_of = [&](const ExecutorSpec& part) { return part.entry->traits.family == family; };
    return std::ranges::none_of(
        executors, [&](const ExecutorSpec& spec) { return std::ranges::any_of(parts(spec), is_of); });
  };
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& option, const char* missing) {
    sentences.push_back(option + " changes nothing: none of these executors has " + missing);
  };
  if (none(Family::priority_events)) {
    if (options.rule != SubscriptionRule::inherit) add("--rule", "priorities");
    if (options.ties != Ties::lifo) add("--ties", "priorities");
  }
  if (none(Family::wait_set) && options.entity_order != "creation") add("--entity-order", "a wait set");
  return sentences;
}

json bounds_json(const Graph& graph, const GraphTasks& tasks, const std::vector<ExecutorSpec>& executors) {
  json bounds = json::array();
  if (!timers_only(tasks.set)) return bounds;
  const CallbackGraph callbacks = callback_graph(graph, tasks, false);
  for (const ExecutorSpec& executor : executors) {
    if (executor.deployment) continue;
    const std::vector<GraphBounds> sets =
        graph_bounds(bounded_system(graph, callbacks, *executor.entry, executor.scheduler));
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const auto bound = [&](const GraphBounds& set) {
        return set.tasks.empty() || !set.tasks[id] ? Duration::max() : Duration(*set.tasks[id]);
      };
      const GraphBounds& tightest = *std::ranges::min_element(sets, {}, bound);
      if (bound(tightest) == Duration::max()) continue;
      bounds.push_back({{"executor", executor.label},
                        {"task", tasks.set[id].name},
                        {"ms", to_ms(bound(tightest))},
                        {"method", tightest.method}});
    }
  }
  return bounds;
}

json platform_json(const GraphPlatform& platform) {
  json j = {{"cores", platform.cores}, {"timer_thread", to_string(platform.timer_thread)}};
  for (const PlatformCost& cost : kPlatformCosts) {
    j[std::string(cost.key)] = to_us(platform.*cost.value);
  }
  return j;
}

GraphPlatform platform_from_json(const json& j) {
  GraphPlatform platform;
  platform.cores = j.at("cores").get<unsigned>();
  platform.timer_thread =
      parse<TimerThread>(j.at("timer_thread").get<std::string>()).value_or(platform.timer_thread);
  for (const PlatformCost& cost : kPlatformCosts) {
    platform.*cost.value = from_ms(j.at(std::string(cost.key)).get<double>() / 1000);
  }
  return platform;
}

}  // namespace hotpath
