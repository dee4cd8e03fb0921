// SPDX-License-Identifier: Apache-2.0
#include "setup/run_setup.hpp"

#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <set>

#include "bounds/bounds.hpp"
#include "hotpath/reference_system/chain_limits.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "results/run_facts.hpp"

namespace hotpath {

using nlohmann::json;

Duration seconds(double s) { return from_ms(s * 1000); }

std::string time_stamp(const char* format) {
  const std::time_t now = std::time(nullptr);
  char text[64];
  std::strftime(text, sizeof(text), format, std::localtime(&now));
  return text;
}

std::string output_folder(const CommonOptions& options, const Graph& graph) {
  return options.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-" + graph.name : options.output;
}

Graph graph_to_run(const CommonOptions& options) {
  Graph graph = load_graph(find_graph(options.graph));
  if (options.work) graph.work = *options.work;
  if (options.load_percent) {
    try {
      scale_to_load(graph, *options.load_percent);
    } catch (const std::invalid_argument& error) {
      throw UsageError("--load: " + std::string(error.what()));
    }
  }
  return graph;
}

std::vector<ExecutorSpec> executors_to_run(const CommonOptions& options) {
  const SchedulerOptions defaults{options.rule, options.ties, 0};
  std::vector<ExecutorSpec> executors;
  std::set<std::string> labels;
  for (const std::string& name : options.executors) {
    executors.push_back(parse_executor(name, defaults));
    if (!labels.insert(name).second) throw UsageError("executor `" + name + "` is named twice");
  }
  return executors;
}

std::vector<Duration> phases_of_repetition(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, const ExecutorSpec& executor,
                                           std::uint32_t repetition) {
  if (!options.phases_file.empty()) {
    return read_phases(options.phases_file, graph, std::string(executor.entry->name));
  }
  PhaseOptions phase_options;
  if (options.phase_step_ms) phase_options.step = from_ms(*options.phase_step_ms);
  phase_options.seed = options.seed + repetition;
  try {
    return make_phases(graph, tasks, options.phases, phase_options);
  } catch (const std::invalid_argument& error) {
    throw UsageError("--phases given: " + std::string(error.what()));
  }
}

std::vector<std::string> chain_names(const Graph& graph) {
  std::vector<std::string> names;
  for (const Chain& chain : graph.chains) names.push_back(chain.name);
  return names;
}

std::vector<MeasuredChain> measured_chains(const Graph& graph, const GraphTasks& tasks) {
  std::vector<MeasuredChain> chains;
  for (ChainIndex& chain : index_chains(graph, tasks)) {
    MeasuredChain& m = chains.emplace_back();
    m.name = graph.chains[chains.size() - 1].name;
    m.sink_tasks = std::move(chain.sink_tasks);
  }
  return chains;
}

SummaryOptions summary_options(const CommonOptions& options, const Graph& graph, const GraphTasks& tasks) {
  SummaryOptions s;
  s.chains = chain_names(graph);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const bool cyclic = graph.nodes[tasks.origin[id].node].type == NodeType::cyclic;
    if (cyclic && !tasks.origin[id].input) s.cyclic_timers.push_back(id);
  }
  s.warm_up = seconds(options.warm_up_s);
  s.bootstrap.seed = options.seed;
  return s;
}

json common_facts(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                  const std::vector<ExecutorSpec>& executors) {
  std::vector<std::string> labels;
  for (const ExecutorSpec& e : executors) labels.push_back(e.label);
  json limits = json::array();
  const double load = load_percent(graph);
  if (!graph.chains.empty() && load > 0) {
    const ChainLimits l = chain_limits(graph, graph.chains.front());
    limits = {{{"label", "limit with one core per branch"}, {"ms", to_ms(l.one_core_per_branch)}},
              {{"label", "limit on one thread"}, {"ms", to_ms(l.one_thread)}}};
  }
  return {{"complete", false},
          {"partial", false},
          {"version", HOTPATH_VERSION},
          {"graph", {{"name", graph.name}, {"nodes", graph.nodes.size()}, {"file", options.graph}}},
          {"tasks", tasks_json(set)},
          {"chains", chain_names(graph)},
          {"executors", labels},
          {"rule", to_string(options.rule)},
          {"ties", to_string(options.ties)},
          {"repetitions", options.repetitions},
          {"duration_s", options.duration_s},
          {"warm_up_s", options.warm_up_s},
          {"seed", options.seed},
          {"phases", to_string(options.phases)},
          {"load_percent", std::round(load * 1000) / 1000},
          {"work", to_string(graph.work)},
          {"limits", limits},
          {"runs", json::array()},
          {"warnings", json::array()},
          {"failures", json::array()}};
}

json bounds_json(const Graph& graph, const GraphTasks& tasks, const std::vector<ExecutorSpec>& executors,
                 Duration delta) {
  json bounds = json::array();
  for (const Task& task : tasks.set.tasks) {
    if (task.kind != TaskKind::timer) return bounds;
  }
  for (const ExecutorSpec& executor : executors) {
    const std::vector<BoundSet> sets = bounds_of(graph, tasks, *executor.entry, delta);
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const BoundSet* tightest = nullptr;
      for (const BoundSet& set : sets) {
        if (set.tasks.empty() || !set.tasks[id]) continue;
        if (tightest == nullptr || *set.tasks[id] < *tightest->tasks[id]) tightest = &set;
      }
      if (tightest == nullptr) continue;
      bounds.push_back({{"executor", executor.label},
                        {"task", tasks.set[id].name},
                        {"ms", to_ms(*tightest->tasks[id])},
                        {"method", tightest->method}});
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
