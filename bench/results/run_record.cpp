// SPDX-License-Identifier: Apache-2.0
#include "results/run_record.hpp"

#include <nlohmann/json.hpp>

#include "program/json_record.hpp"
#include "program/text.hpp"
#include "results/summary.hpp"

namespace hotpath {

void fields(auto& visit, program::MaybeConst<Calibration> auto& calibration) {
  visit("divisions_per_us", calibration.divisions_per_us);
  visit("spread_percent", calibration.spread_percent);
  visit("readings", calibration.readings);
  visit("disturbed", calibration.disturbed);
}

void fields(auto& visit, program::MaybeConst<GraphPlatform> auto& platform) {
  visit("cores", platform.cores);
  visit("timer_thread", platform.timer_thread);
  for (const PlatformCost& cost : kPlatformCosts) {
    if (cost.other_kind == nullptr) {
      visit.us(cost.key.data(), platform.*cost.value);
      continue;
    }
    std::optional<Duration> value = cost.in(platform);
    visit.us_if_any(cost.key.data(), value);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(platform)>>)
      if (value) cost.set(platform, *value);
  }
}

}  // namespace hotpath

namespace hotpath::results {

using nlohmann::json;

RepetitionRecord record_of(const TaskSet& set, const std::vector<std::string>& chains,
                           const Repetition& repetition) {
  RepetitionRecord record;
  record.executor = repetition.trace.executor;
  record.repetition = repetition.trace.repetition;
  record.usage = repetition.usage;
  record.lost_records = repetition.trace.lost_records;
  for (const Task& task : set.tasks) {
    if (task.kind == TaskKind::timer) record.first_timestamps[task.name] = task.phase;
  }
  for (const TaskAccount& account : repetition.accounts) {
    record.expected[set[account.task].name] = account.expected;
  }
  for (const std::string& chain : chains) record.hot_path_drops[chain] = 0;
  for (const ChainRecord& r : repetition.trace.chains) record.hot_path_drops[chains[r.chain]] += r.dropped;
  return record;
}

std::string RunRecord::command_line() const {
  std::string line = "hotpath";
  for (const std::string& word : command) line += " " + program::shell_word(word);
  return line;
}

std::uint64_t RepetitionRecord::expected_of(const std::string& task) const {
  const auto found = expected.find(task);
  if (found == expected.end()) throw std::out_of_range("`expected` has no " + task);
  return found->second;
}

void fields(auto& visit, program::MaybeConst<GraphRecord> auto& graph) {
  visit("name", graph.name);
  visit("nodes", graph.nodes);
  visit("file", graph.file);
}

void fields(auto& visit, program::MaybeConst<DeployedExecutorRecord> auto& executor) {
  visit("name", executor.name);
  visit("executor", executor.executor);
  visit("policy", executor.policy);
  visit("processors", executor.processors);
  visit("process", executor.process);
  visit("first_worker", executor.first_worker);
  visit("workers", executor.workers);
  visit("tasks", executor.tasks);
}

void fields(auto& visit, program::MaybeConst<DeploymentRecord> auto& deployment) {
  visit("name", deployment.name);
  visit("file", deployment.file);
  visit("executors", deployment.executors);
}

void fields(auto& visit, program::MaybeConst<LimitRecord> auto& limit) {
  visit("label", limit.label);
  visit.ms("ms", limit.latency);
}

void fields(auto& visit, program::MaybeConst<BoundRecord> auto& bound) {
  visit("executor", bound.executor);
  visit("task", bound.task);
  visit.ms("ms", bound.response);
  visit("method", bound.method);
}

void fields(auto& visit, program::MaybeConst<InputRecord> auto& input) {
  visit("kind", input.kind);
  visit("file", input.file);
  visit("original", input.original);
  visit("hash", input.hash);
}

void fields(auto& visit, program::MaybeConst<RepetitionRecord> auto& repetition) {
  visit("executor", repetition.executor);
  visit("repetition", repetition.repetition);
  visit.ms("first_timestamps_ms", repetition.first_timestamps);
  visit("expected", repetition.expected);
  visit("hot_path_drops", repetition.hot_path_drops);
  visit("usage", repetition.usage);
  visit("lost_records", repetition.lost_records);
  visit("failure", repetition.failure);
  visit.if_any("thread_policies", repetition.thread_policies);
  visit.if_any("live", repetition.published);
}

/// The keys of SimulationRecord and LiveRecord stand beside those of RunRecord.
void fields(auto& visit, program::MaybeConst<SimulationRecord> auto& simulation) {
  visit("platform", simulation.platform);
  visit("execution_times", simulation.execution_times);
  visit.if_any("max_backlog", simulation.max_backlog);
  visit.unless(false, "no_trace", simulation.no_trace);
  visit.unless(false, "drawn", simulation.drawn);
}

void fields(auto& visit, program::MaybeConst<LiveRecord> auto& live) {
  visit("date", live.date);
  visit("transport", live.transport);
  visit("stacks", live.stacks);
  visit("network", live.network);
  visit("processes", live.processes);
  visit.if_stored("domain", live.domain);
  visit.if_stored("all_interfaces", live.all_interfaces);
  visit.if_stored("executor_policy", live.executor_policy);
  visit.if_stored("timer_policy", live.timer_policy);
  visit.if_stored("lock_memory", live.lock_memory);
  visit.if_stored("cpu_time", live.cpu_time);
  visit("cpus", live.cpus);
  visit.if_stored("live_cpus", live.live_cpus);
  visit.if_any("calibration", live.calibration);
  visit("machine", live.machine);
}

void fields(auto& visit, program::MaybeConst<RunRecord> auto& run) {
  visit("kind", run.kind);
  visit("version", run.version);
  visit("complete", run.complete);
  visit("partial", run.partial);
  visit.unless({}, "command", run.command);
  visit("graph", run.graph);
  visit("chains", run.chains);
  visit("load_percent", run.load_percent);
  visit("load_given", run.load_given);
  visit.if_any("rate_percent", run.rate_percent);
  visit.unless(1, "copies", run.copies);
  visit("work", run.work);
  visit("executors", run.executors);
  visit.if_stored("deployments", run.deployments);
  visit("rule", run.rule);
  visit("ties", run.ties);
  visit.if_stored("entity_order", run.entity_order);
  visit.unless({}, "inputs", run.inputs);
  visit.unless({}, "revision", run.revision);
  visit.unless({}, "entity_tasks", run.entity_tasks);
  visit("repetitions", run.repetitions);
  constexpr double kLongestS = 1e9;
  visit.up_to(kLongestS, "duration_s", run.duration_s);
  visit.up_to(kLongestS, "warm_up_s", run.warm_up_s);
  visit("seed", run.seed);
  visit("phases", run.phases);
  visit.unless({}, "phases_file", run.phases_file);
  visit.if_any("phase_step_ms", run.phase_step_ms);
  visit("limits", run.limits);
  visit("bounds", run.bounds);
  visit("runs", run.runs);
  visit("warnings", run.warnings);
  visit("failures", run.failures);
}

/// `tasks`: {task, kind, wcet_ns, reentrant}, for timers also {period_ns, deadline_ns}.
static json tasks_json(const TaskSet& set) {
  json tasks = json::array();
  for (const Task& task : set.tasks) {
    json& j = tasks.emplace_back(
        json{{"task", task.name}, {"kind", to_string(task.kind)}, {"wcet_ns", task.wcet.count()}});
    if (set.groups[task.group] == CallbackGroup::reentrant) j["reentrant"] = true;
    if (task.kind != TaskKind::timer) continue;
    j["period_ns"] = task.period.count();
    j["deadline_ns"] = task.deadline.count();
  }
  return tasks;
}

static TaskSet tasks_from_json(const json& tasks) {
  TaskSet set;
  set.groups = {CallbackGroup::mutually_exclusive, CallbackGroup::reentrant};
  for (const json& j : tasks) {
    Task& task = set.tasks.emplace_back();
    task.group = j.value("reentrant", false) ? 1 : 0;
    task.name = j.at("task").get<std::string>();
    program::JsonReader read(j);
    read("kind", task.kind);
    if (j.contains("wcet_ns")) read.ns("wcet_ns", task.wcet);  // runs of the first version lack it
    if (task.kind != TaskKind::timer) continue;
    read.ns("period_ns", task.period);
    read.ns("deadline_ns", task.deadline);
    if (task.period == Duration{}) throw std::out_of_range("`period_ns` of " + task.name + " is 0");
  }
  return set;
}

void to_json(json& j, const RunRecord& run) {
  j = json::object();
  program::JsonWriter write(j);
  fields(write, run);
  j["tasks"] = tasks_json(run.tasks);
  if (run.simulation) fields(write, *run.simulation);
  if (run.live) fields(write, *run.live);
}

void from_json(const json& j, RunRecord& run) {
  program::JsonReader read(j);
  fields(read, run);
  if (j.contains("tasks")) run.tasks = tasks_from_json(j.at("tasks"));
  if (j.contains("cpus")) {
    fields(read, run.live.emplace());
  } else {
    fields(read, run.simulation.emplace());
  }
}

}  // namespace hotpath::results
