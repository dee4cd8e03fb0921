// SPDX-License-Identifier: Apache-2.0
#include "results/run_facts.hpp"

#include <algorithm>

namespace hotpath {

using nlohmann::json;

json tasks_json(const TaskSet& set) {
  json tasks = json::array();
  for (const Task& task : set.tasks) {
    if (task.kind == TaskKind::timer) {
      tasks.push_back({{"task", task.name},
                       {"kind", "timer"},
                       {"period_ns", task.period.count()},
                       {"deadline_ns", task.deadline.count()}});
    } else {
      tasks.push_back({{"task", task.name}, {"kind", "subscription"}});
    }
  }
  return tasks;
}

TaskSet tasks_from_json(const json& tasks) {
  TaskSet set;
  for (const json& j : tasks) {
    Task& task = set.tasks.emplace_back();
    task.name = j.at("task").get<std::string>();
    task.kind = j.at("kind") == "timer" ? TaskKind::timer : TaskKind::subscription;
    if (task.kind != TaskKind::timer) continue;
    task.period = Duration(j.at("period_ns").get<std::int64_t>());
    task.deadline = Duration(j.at("deadline_ns").get<std::int64_t>());
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
  for (const std::string& chain : chains) drops[chain] = 0;
  for (const ChainRecord& r : repetition.trace.chains) {
    json& of_chain = drops[chains[r.chain]];
    of_chain = of_chain.get<std::uint64_t>() + r.dropped;
  }
  return {{"executor", repetition.trace.executor},
          {"repetition", repetition.trace.repetition},
          {"first_timestamps_ms", first},
          {"usage", to_json(repetition.usage)},
          {"lost_records", repetition.trace.lost_records},
          {"expected", expected},
          {"hot_path_drops", drops}};
}

void complete_repetition(const json& run, const TaskSet& set, const std::vector<std::string>& chains,
                         Repetition& repetition) {
  Trace& trace = repetition.trace;
  repetition.accounts = account(set, trace);
  const bool known = run.contains("expected");
  for (TaskAccount& a : repetition.accounts) {
    a.expected = known ? run["expected"].at(set[a.task].name).get<std::uint64_t>() : a.accounted();
  }
  if (!known) return;
  repetition.usage = usage_from_json(run.at("usage"));
  trace.lost_records = run.at("lost_records").get<std::uint64_t>();
  for (std::uint32_t c = 0; c < chains.size(); ++c) {
    // Only their sum is kept: it goes to the last output.
    const auto last = std::find_if(trace.chains.rbegin(), trace.chains.rend(),
                                   [&](const ChainRecord& r) { return r.chain == c; });
    if (last == trace.chains.rend()) continue;
    last->dropped = run.at("hot_path_drops").at(chains[c]).get<std::uint32_t>();
  }
}

}  // namespace hotpath
