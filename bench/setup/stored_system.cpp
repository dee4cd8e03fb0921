// SPDX-License-Identifier: Apache-2.0
#include "setup/stored_system.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program/text.hpp"
#include "results/run_facts.hpp"
#include "setup/setup_facts.hpp"

namespace hotpath {

using nlohmann::json;

namespace {

template <class Value>
std::optional<Value> optional_at(const json& facts, const char* key) {
  const auto value = facts.find(key);
  return value == facts.end() || value->is_null() ? std::optional<Value>() : value->get<Value>();
}

/// The enumerator under a key; the enumeration's default for a word that this version does not
/// know.
template <class Enum>
Enum word(const json& facts, const char* key) {
  return parse<Enum>(facts.at(key).get<std::string>()).value_or(Enum{});
}

CommonOptions options_of(const StoredRun& run) {
  const json& facts = run.facts();
  CommonOptions options;
  options.graph = facts.at("graph").at("file").get<std::string>();
  const json deployments = facts.value("deployments", json::object());
  for (const std::string& label : run.executors()) {
    if (!deployments.contains(label)) options.executors.push_back(label);
  }
  options.duration_s = facts.at("duration_s").get<double>();
  options.warm_up_s = facts.at("warm_up_s").get<double>();
  options.repetitions = facts.at("repetitions").get<std::uint32_t>();
  options.seed = facts.value("seed", options.seed);
  options.load_percent = optional_at<double>(facts, "load_given");
  options.rate_percent = optional_at<double>(facts, "rate_percent");
  options.copies = facts.value("copies", options.copies);
  options.work = word<WorkMode>(facts, "work");
  options.rule = word<SubscriptionRule>(facts, "rule");
  options.ties = word<Ties>(facts, "ties");
  options.entity_order = facts.value("entity_order", options.entity_order);
  options.entity_tasks = facts.value("entity_tasks", options.entity_tasks);
  return options;
}

/// run.json has only the graph's name or path, so the graph may have changed.
void check_unchanged(const StoredRun& run, const Graph& graph, const TaskSet& set) {
  for (const json& stored : run.facts().at("tasks")) {
    const auto name = stored.at("task").get<std::string>();
    const auto task = std::ranges::find(set.tasks, name, &Task::name);
    // A task of another graph: reading the jobs reports it, with the line.
    if (task == set.tasks.end()) continue;
    const auto compare = [&](const char* key, const char* attribute, Duration value) {
      const auto before = stored.value(key, value.count());
      if (before == value.count()) return;
      run.fail(concat("its task ", name, " has ", attribute, " of ", before, " ns, and of ", value.count(),
                      " ns in graph ", graph.name, ": the graph has changed since; run it again"));
    };
    compare("wcet_ns", "an execution time", task->wcet);
    compare("period_ns", "a period", task->period);
    compare("deadline_ns", "a deadline", task->deadline);
  }
}

ExecutorSpec deployed(const StoredRun& run, const json& stored, const TaskSet& set,
                      const SchedulerOptions& scheduling) {
  Deployment plan;
  plan.name = stored.at("name").get<std::string>();
  plan.file = (run.folder() / "run.json").string();
  plan.executor_of.assign(set.size(), 0);
  for (const json& of : stored.at("executors")) {
    DeployedExecutor& executor = plan.executors.emplace_back();
    executor.name = of.at("name").get<std::string>();
    executor.executor = of.at("executor").get<std::string>();
    executor.policy = parse_thread_policy(of.at("policy").get<std::string>());
    of.at("processors").get_to(executor.processors);
    of.at("process").get_to(executor.process);
    plan.processes.resize(std::max<std::size_t>(plan.processes.size(), executor.process + 1));
    for (const json& task : of.at("tasks")) {
      const auto at = std::ranges::find(set.tasks, task.get<std::string>(), &Task::name);
      if (at == set.tasks.end())
        run.fail("the graph has no task " + task.dump() + "; does the run belong to another graph?");
      plan.executor_of[static_cast<std::size_t>(at - set.tasks.begin())] =
          static_cast<std::uint32_t>(plan.executors.size() - 1);
    }
  }
  return deploy(std::move(plan), scheduling);
}

}  // namespace

const ExecutorSpec& StoredSystem::executor(const std::string& label) const {
  const auto spec = std::ranges::find(executors, label, &ExecutorSpec::label);
  if (spec == executors.end()) throw std::out_of_range("`executors` has no " + label);
  return *spec;
}

GraphTasks StoredSystem::tasks_of(const StoredRun& run, const std::string& label,
                                  std::uint32_t repetition) const {
  GraphTasks with_phases = tasks;
  set_phases(with_phases.set, run.first_timestamps(tasks.set, label, repetition));
  return with_phases;
}

StoredSystem stored_system(const StoredRun& run, const std::string& graph) {
  return run.check([&] {
    const json& facts = run.facts();
    StoredSystem system;
    system.options = options_of(run);
    if (!graph.empty()) system.options.graph = graph;
    system.graph = graph_to_run(system.options);
    system.simulated = facts.value("kind", "") == "simulated";
    system.execution_times = facts.value("execution_times", "");
    system.backlog = optional_at<std::uint64_t>(facts, "max_backlog");
    if (facts.contains("platform")) {
      system.graph.platform = platform_from_json(facts.at("platform"));
      system.graph.platform.execution_times =
          parse<ExecutionTimeModel>(system.execution_times).value_or(ExecutionTimeModel::worst);
    }
    system.tasks = make_tasks(system.graph);
    check_unchanged(run, system.graph, system.tasks.set);
    const SchedulerOptions scheduling = scheduling_of(system.options, system.tasks.set, run.cores());
    const json deployments = facts.value("deployments", json::object());
    for (const std::string& label : run.executors()) {
      const auto stored = deployments.find(label);
      system.executors.push_back(stored == deployments.end()
                                     ? parse_executor(label, scheduling)
                                     : deployed(run, *stored, system.tasks.set, scheduling));
    }
    return system;
  });
}

}  // namespace hotpath
