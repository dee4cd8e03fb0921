// SPDX-License-Identifier: Apache-2.0
#include "results/run_record.hpp"

#include "program/text.hpp"
#include "results/summary.hpp"

namespace hotpath {

static void to_json(nlohmann::json& j, const ThreadPolicy& policy) { j = to_string(policy); }
static void from_json(const nlohmann::json& j, ThreadPolicy& policy) { policy = parse_thread_policy(j); }

void fields(auto& visit, program::MaybeConst<Calibration> auto& part) {
  HOTPATH_VISIT(divisions_per_us, spread_percent, readings, disturbed)
}

/// An element of `tasks`, which also has `reentrant` where its callback group is.
void fields(auto& visit, program::MaybeConst<Task> auto& task) {
  visit("task", task.name);
  visit("kind", task.kind);
  visit.ns("wcet_ns", task.wcet);
  if (task.kind != TaskKind::timer) return;
  visit.ns("period_ns", task.period);
  visit.ns("deadline_ns", task.deadline);
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
  for (const TaskId id : set.timers()) record.first_timestamps[set[id].name] = set[id].phase;
  for (TaskId id = 0; id < repetition.expected.size(); ++id)
    record.expected[set[id].name] = repetition.expected[id];
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

static json tasks_json(const TaskSet& set) {
  json tasks = set.tasks;
  for (TaskId id = 0; id < set.size(); ++id)
    if (set.groups[set[id].group] == CallbackGroup::reentrant) tasks[id]["reentrant"] = true;
  return tasks;
}

static TaskSet tasks_from_json(const json& tasks) {
  TaskSet set;
  set.groups = {CallbackGroup::mutually_exclusive, CallbackGroup::reentrant};
  for (const json& j : tasks) {
    Task& task = set.tasks.emplace_back(j.get<Task>());
    task.group = j.value("reentrant", false) ? 1 : 0;
    if (task.kind == TaskKind::timer && task.period == Duration{})
      throw std::out_of_range("`period_ns` of " + task.name + " is 0");
  }
  return set;
}

void to_json(json& j, const RunRecord& run) {
  j = json::object();
  program::JsonFields write(j);
  visit_fields(write, run);
  j["tasks"] = tasks_json(run.tasks);
  if (run.simulation) visit_fields(write, *run.simulation);
  if (run.live) visit_fields(write, *run.live);
}

void from_json(const json& j, RunRecord& run) {
  program::JsonFields read(j);
  visit_fields(read, run);
  run.tasks = tasks_from_json(j.at("tasks"));
  j.contains("cpus") ? visit_fields(read, run.live.emplace()) : visit_fields(read, run.simulation.emplace());
}

}  // namespace hotpath::results
