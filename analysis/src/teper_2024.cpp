// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/teper_2024.hpp"

#include <algorithm>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply, exact::subtract;

constexpr std::string_view kMethod = "the default executor's bound (teper_2024)";

/// Lemma VI.2: `all` is the length of a processing window, `higher` the part of it before the timer.
std::int64_t until_timer_starts(std::int64_t period, std::int64_t cost, std::int64_t all,
                                std::int64_t higher) {
  return add(all, std::max<std::int64_t>(0, add(subtract(period, cost), higher)));
}

}  // namespace

std::vector<TaskId> poll_order(const TaskSet& set) {
  std::vector<TaskId> order;
  for (const TaskKind kind : {TaskKind::timer, TaskKind::subscription}) {
    for (TaskId id = 0; id < set.size(); ++id) {
      if (set[id].kind == kind) order.push_back(id);
    }
  }
  return order;
}

std::int64_t teper_2024(const TaskSet& set, const std::vector<TaskId>& chain) {
  if (chain.empty()) {
    throw AnalysisError(std::string(kMethod) + ": the chain is empty; name at least one callback");
  }
  std::vector<std::int64_t> higher(set.size(), 0);
  std::int64_t all = 0;
  for (const TaskId id : poll_order(set)) {
    higher[id] = all;
    all = add(all, set[id].wcet.count());
  }
  std::int64_t latency = 0;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const TaskId id = chain[i];
    const Task& task = set[id];
    const std::int64_t cost = task.wcet.count();
    std::int64_t start = 0;
    if (task.kind == TaskKind::timer) {
      start = until_timer_starts(task.period.count(), cost, all, higher[id]);
    } else if (i == 0) {  // Lemma VI.4
      start = add(multiply(task.depth, all), std::max<std::int64_t>(0, higher[id] - cost));
    } else {  // Lemma VI.5: the rest of the predecessor's window, and the part of the next one
      const TaskId before = chain[i - 1];
      start = add(all - higher[before] - set[before].wcet.count(), higher[id]);
    }
    latency = add(latency, add(start, cost));
  }
  return latency;
}

std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks) {
  check_tasks(tasks, {.method = kMethod, .instead = "", .jitter = false});
  std::int64_t all = 0, higher = 0;
  for (const PeriodicTask& t : tasks) all = add(all, t.wcet);
  std::vector<std::int64_t> bounds;
  bounds.reserve(tasks.size());
  for (const PeriodicTask& t : tasks) {
    bounds.push_back(add(until_timer_starts(t.period, t.wcet, all, higher), t.wcet));
    higher += t.wcet;  // at most `all`
  }
  return bounds;
}

}  // namespace hotpath
