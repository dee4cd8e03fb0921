// SPDX-License-Identifier: Apache-2.0
#include "results/run_facts.hpp"

#include "hotpath/core/csv.hpp"
#include "program/json_fields.hpp"

namespace hotpath {

using nlohmann::json;

json tasks_json(const TaskSet& set) {
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

TaskSet tasks_from_json(const json& tasks) {
  TaskSet set;
  set.groups = {CallbackGroup::mutually_exclusive, CallbackGroup::reentrant};
  for (const json& j : tasks) {
    Task& task = set.tasks.emplace_back();
    task.group = j.value("reentrant", false) ? 1 : 0;
    task.name = j.at("task").get<std::string>();
    task.kind = j.at("kind") == "timer" ? TaskKind::timer : TaskKind::subscription;
    // Runs of the first version lack this key.
    if (j.contains("wcet_ns")) task.wcet = Duration(number_up_to(kLongest.count(), j, "wcet_ns"));
    if (task.kind != TaskKind::timer) continue;
    task.period = Duration(number_up_to(kLongest.count(), j, "period_ns"));
    task.deadline = Duration(number_up_to(kLongest.count(), j, "deadline_ns"));
    if (task.period == Duration{}) throw std::out_of_range("`period_ns` of " + task.name + " is 0");
  }
  return set;
}

json repetition_json(const TaskSet& set, const std::vector<std::string>& chains,
                     const Repetition& repetition) {
  json first = json::object(), expected = json::object(), drops = json::object();
  for (const Task& task : set.tasks) {
    if (task.kind == TaskKind::timer) first[task.name] = to_ms(task.phase);
  }
  for (const TaskAccount& account : repetition.accounts) expected[set[account.task].name] = account.expected;
  for (std::size_t c = 0; c < chains.size(); ++c) {
    std::uint64_t dropped = 0;
    for (const ChainRecord& r : repetition.trace.chains) dropped += r.chain == c ? r.dropped : 0;
    drops[chains[c]] = dropped;
  }
  return {{"executor", repetition.trace.executor},
          {"repetition", repetition.trace.repetition},
          {"first_timestamps_ms", first},
          {"usage", repetition.usage},
          {"lost_records", repetition.trace.lost_records},
          {"expected", expected},
          {"hot_path_drops", drops}};
}

}  // namespace hotpath
