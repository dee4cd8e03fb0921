// SPDX-License-Identifier: Apache-2.0
#include "setup/run_setup.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "bounds/bounds.hpp"
#include "hotpath/reference_system/chain_limits.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_scaling.hpp"
#include "program/errors.hpp"
#include "results/run_facts.hpp"

namespace hotpath {

using nlohmann::json;

void PlatformOptions::apply_to(GraphPlatform& platform) const {
  platform.cores = cores.value_or(platform.cores);
  platform.timer_thread = timer_thread.value_or(platform.timer_thread);
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    if (costs_us[i]) platform.*kPlatformCosts[i].value = from_ms(*costs_us[i] / 1000);
  }
}

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
  if (options.rate_percent) scale_rates(graph, *options.rate_percent);
  try {
    make_copies(graph, options.copies);
  } catch (const std::invalid_argument& error) {
    throw UsageError("--copies: " + std::string(error.what()));
  }
  return graph;
}

namespace {

/// What --entity-order says; empty for the order of creation.
std::vector<TaskId> entity_order(const std::string& text, const TaskSet& set) {
  std::vector<TaskId> order;
  if (text == "creation") return order;
  if (text == "reverse") {
    for (TaskId id = set.size(); id-- > 0;) order.push_back(id);
    return order;
  }
  std::ifstream file(text);
  if (!file) {
    throw UsageError("--entity-order: `" + text +
                     "` is none of creation and reverse, nor a readable file of task names");
  }
  std::int64_t line = 0;
  for (std::string name; std::getline(file, name);) {
    ++line;
    if (name.empty()) continue;
    const auto task = std::ranges::find(set.tasks, name, &Task::name);
    const auto id = static_cast<TaskId>(task - set.tasks.begin());
    if (task == set.tasks.end()) throw InputError(text, line, "the graph has no task " + name, "name tasks");
    if (std::ranges::count(order, id) > 0)
      throw InputError(text, line, name + " occurs twice", "name it once");
    order.push_back(id);
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    if (std::ranges::count(order, id) == 0) order.push_back(id);
  }
  return order;
}

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

std::vector<ExecutorSpec> executors_to_run(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, unsigned threads) {
  const SchedulerOptions defaults{options.rule, options.ties, threads,
                                  entity_order(options.entity_order, tasks.set)};
  std::vector<ExecutorSpec> executors;
  for (const std::string& name : options.executors) executors.push_back(parse_executor(name, defaults));
  for (const std::string& name : options.deployments) {
    executors.push_back(deploy(name, graph, tasks, defaults));
  }
  std::set<std::string> labels;
  for (const ExecutorSpec& e : executors) {
    if (!labels.insert(e.label).second)
      throw UsageError("executor or deployment `" + e.label + "` is named twice");
  }
  return executors;
}

std::vector<Duration> phases_of_repetition(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, const ExecutorSpec& executor,
                                           std::uint32_t repetition) {
  if (!options.phases_file.empty()) {
    return read_phases(options.phases_file, graph,
                       executor.label.substr(0, executor.label.find_first_of(":@")));
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

std::vector<std::pair<std::uint32_t, std::size_t>> interleaved(std::uint32_t repetitions,
                                                               std::size_t subjects, std::uint64_t seed) {
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  std::mt19937_64 random(seed);
  for (std::uint32_t r = 0; r < repetitions; ++r) {
    const auto begin = order.size();
    for (std::size_t s = 0; s < subjects; ++s) order.emplace_back(r, s);
    for (std::size_t i = order.size() - 1; i > begin; --i) {
      std::swap(order[i], order[begin + random() % (i - begin + 1)]);
    }
  }
  return order;
}

void set_phases(TaskSet& set, const std::vector<Duration>& first) {
  for (TaskId id = 0; id < first.size(); ++id) set.tasks[id].phase = first[id];
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
  return facts;
}

json bounds_json(const Graph& graph, const GraphTasks& tasks, const std::vector<ExecutorSpec>& executors) {
  json bounds = json::array();
  if (!timers_only(tasks.set)) return bounds;
  const CallbackGraph callbacks = callback_graph(graph, tasks, false);
  for (const ExecutorSpec& executor : executors) {
    if (executor.deployment) continue;
    const std::vector<GraphBounds> sets = graph_bounds(bounded_system(graph, callbacks, executor));
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
