// SPDX-License-Identifier: Apache-2.0
#include "setup/stored_system.hpp"

#include <algorithm>

#include "program/text.hpp"
#include "results/stored_run.hpp"

namespace hotpath::setup {

namespace {

CommonOptions options_of(const results::RunRecord& record) {
  CommonOptions options;
  static_cast<results::RunOptions&>(options) = record;
  options.graph = record.graph.file;
  for (const std::string& label : record.executors) {
    if (!record.deployments.contains(label)) options.executors.push_back(label);
  }
  options.work = record.work;
  options.entity_order = EntityOrder::parse(record.entity_order);
  return options;
}

/// Another graph may have been given.
void check_unchanged(const results::StoredRun& run, const Graph& graph, const TaskSet& set) {
  for (const Task& stored : run.record().tasks.tasks) {
    const auto task = std::ranges::find(set.tasks, stored.name, &Task::name);
    // A task of another graph: reading the jobs reports it, with the line.
    if (task == set.tasks.end()) continue;
    const auto compare = [&](const char* attribute, Duration before, Duration now) {
      if (before == now) return;
      run.fail(program::concat("its task ", stored.name, " has ", attribute, " of ", before.count(),
                               " ns, and of ", now.count(), " ns in graph ", graph.name,
                               ": the graph has changed since; run it again"));
    };
    compare("an execution time", stored.wcet, task->wcet);
    compare("a period", stored.period, task->period);
    compare("a deadline", stored.deadline, task->deadline);
  }
}

ExecutorSpec deployed(const results::StoredRun& run, const results::DeploymentRecord& stored,
                      const TaskSet& set, const SchedulerOptions& scheduling) {
  Deployment plan;
  plan.name = stored.name;
  plan.file = (run.folder() / "run.json").string();
  plan.executor_of.assign(set.size(), 0);
  for (const results::DeployedExecutorRecord& of : stored.executors) {
    plan.executors.push_back(of);
    plan.processes.resize(std::max<std::size_t>(plan.processes.size(), of.process + 1));
    for (const std::string& name : of.tasks) {
      const auto task = std::ranges::find(set.tasks, name, &Task::name);
      if (task == set.tasks.end())
        run.fail("the graph has no task " + name + "; does the run belong to another graph?");
      plan.executor_of[static_cast<std::size_t>(task - set.tasks.begin())] =
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

GraphTasks StoredSystem::tasks_of(const results::StoredRun& run, const std::string& label,
                                  std::uint32_t repetition) const {
  GraphTasks with_phases = tasks;
  set_phases(with_phases.set, run.first_timestamps(tasks.set, label, repetition));
  return with_phases;
}

StoredSystem stored_system(const results::StoredRun& run, const std::string& graph) {
  const results::RunRecord& record = run.record();
  StoredSystem system;
  system.options = options_of(record);
  if (const auto kept = results::kept_input(run, "graph")) system.options.graph = *kept;
  if (!graph.empty()) system.options.graph = graph;
  system.graph = graph_to_run(system.options);
  system.simulated = record.kind == results::RunKind::simulated;
  if (record.simulation) {
    system.times = TimesSource::parse(record.simulation->execution_times);
    system.backlog = record.simulation->max_backlog;
    const MeasuredDelivery measured = system.graph.platform.measured_delivery;
    system.graph.platform = record.simulation->platform;
    if (!system.simulated) system.graph.platform.measured_delivery = measured;
    system.graph.platform.execution_times =
        system.times.value_or(TimesSource{}).model.value_or(ExecutionTimeModel::worst);
  }
  system.tasks = make_tasks(system.graph);
  check_unchanged(run, system.graph, system.tasks.set);
  const SchedulerOptions scheduling =
      scheduling_of(system.options, system.graph, system.tasks.set, record.cores());
  for (const std::string& label : record.executors) {
    const auto stored = record.deployments.find(label);
    system.executors.push_back(stored == record.deployments.end()
                                   ? parse_executor(label, scheduling)
                                   : deployed(run, stored->second, system.tasks.set, scheduling));
  }
  return system;
}

}  // namespace hotpath::setup
