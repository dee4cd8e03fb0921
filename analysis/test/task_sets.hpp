// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <sstream>

#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/random_stream.hpp"
#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

inline constexpr std::int64_t kUs = 1'000;
inline constexpr std::int64_t kMs = 1'000'000;

inline PeriodicTask task(std::int64_t wcet, std::int64_t period, std::int64_t deadline = 0) {
  return {.name = {}, .wcet = wcet, .period = period, .deadline = deadline > 0 ? deadline : period};
}

/// Prints a task set as a graph file, one millisecond per unit, so that a failing set can be passed
/// to the command line.
inline std::string as_graph(const PeriodicTasks& tasks) {
  std::ostringstream out;
  out << "\nname: counterexample\nnodes:\n";
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const PeriodicTask& t = tasks[i];
    out << "  - {name: t" << i << ", type: sensor, period_ms: " << t.period << ", deadline_ms: " << t.deadline
        << ", execution_time_ms: " << t.wcet << ", best_case_execution_time_ms: " << t.bcet
        << ", phase_ms: " << t.phase << ", priority: " << i << "}";
    if (t.jitter != 0) out << "  # release jitter " << t.jitter;
    out << '\n';
  }
  return out.str();
}

inline std::string as_text(const TaskChain& chain) {
  std::string text = "chain";
  for (const std::size_t i : chain) text += " t" + std::to_string(i);
  return text + '\n';
}

struct RandomSet {
  std::size_t min_tasks = 2, max_tasks = 5;
  std::vector<std::int64_t> periods = {4, 5, 6, 8, 10, 12, 15, 20, 24, 30};
  double max_wcet_share = 0.4;  // of the period
  bool constrained = false;     // deadlines below the period
  bool phases = false;
  bool jitter = false;
  bool shorter_runs = false;  // bcet below wcet
};

/// A random task set in rate-monotonic order, with integer times.
inline PeriodicTasks random_tasks(RandomStream& random, const RandomSet& parameters) {
  const auto in = [&](std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(random.below(static_cast<std::uint64_t>(high - low + 1)));
  };
  PeriodicTasks tasks(parameters.min_tasks + random.below(parameters.max_tasks - parameters.min_tasks + 1));
  for (PeriodicTask& t : tasks) {
    t.period = parameters.periods[random.below(parameters.periods.size())];
    t.wcet = in(1, std::max<std::int64_t>(1, static_cast<std::int64_t>(parameters.max_wcet_share *
                                                                       static_cast<double>(t.period))));
    t.bcet = parameters.shorter_runs ? in(0, t.wcet) : t.wcet;
    t.deadline = parameters.constrained ? in(t.wcet, t.period) : t.period;
    t.phase = parameters.phases ? in(0, t.period - 1) : 0;
    t.jitter = parameters.jitter ? in(0, t.period / 3) : 0;
  }
  std::stable_sort(tasks.begin(), tasks.end(),
                   [](const PeriodicTask& a, const PeriodicTask& b) { return a.period < b.period; });
  return tasks;
}

/// The task as a timer; `unit`: nanoseconds of its unit of time.
inline Task as_timer(const PeriodicTask& periodic, const std::string& name, std::int64_t unit = 1) {
  Task t;
  t.name = name;
  t.period = Duration(periodic.period * unit);
  t.phase = Duration(periodic.phase * unit);
  t.deadline = Duration(periodic.deadline * unit);
  t.wcet = Duration(periodic.wcet * unit);
  t.bcet = Duration(periodic.bcet * unit);
  return t;
}

/// Least common multiple of the periods.
inline std::int64_t hyperperiod(const PeriodicTasks& tasks) {
  std::int64_t h = 1;
  for (const PeriodicTask& t : tasks) h = exact::lcm(h, t.period);
  return h;
}

inline double utilisation(const PeriodicTasks& tasks) {
  double u = 0;
  for (const PeriodicTask& t : tasks) u += static_cast<double>(t.wcet) / static_cast<double>(t.period);
  return u;
}

}  // namespace hotpath
