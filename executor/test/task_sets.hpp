// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/simulator.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

inline Time at(Duration since_epoch) { return Time{} + since_epoch; }

/// Adds a task in a new callback group.
inline Task& add_task(TaskSet& set, TaskKind kind, Duration wcet) {
  Task& t = set.tasks.emplace_back();
  t.name = (kind == TaskKind::timer ? "T" : "S") + std::to_string(set.size() - 1);
  t.kind = kind;
  t.wcet = t.bcet = wcet;
  t.group = static_cast<std::uint32_t>(set.groups.size());
  set.groups.push_back(CallbackGroup::mutually_exclusive);
  return t;
}

/// Adds a timer with an implicit deadline in a new callback group; returns its id.
inline TaskId add_timer(TaskSet& set, Duration period, Duration wcet, Duration phase = 0ms) {
  Task& t = add_task(set, TaskKind::timer, wcet);
  t.period = t.deadline = period;
  t.phase = phase;
  return set.size() - 1;
}

/// Adds a subscription to the publications of `publishers`, in a new callback group; returns its
/// id.
inline TaskId add_subscription(TaskSet& set, const std::vector<TaskId>& publishers, Duration wcet,
                               std::uint32_t depth = 1) {
  add_task(set, TaskKind::subscription, wcet).depth = depth;
  for (const TaskId p : publishers) set.tasks[p].feeds.push_back(set.size() - 1);
  return set.size() - 1;
}

/// Simulates with constant execution times; the releaser is raised unless `platform` says otherwise.
inline Trace run(const TaskSet& set, const std::string& executor, Duration duration,
                 const Platform& platform = {}, const SchedulerOptions& scheduling = {}) {
  const WorstCaseTimes times(set);
  PublishingWorkload workload(times);
  return simulate_trace(set, *find_executor(executor), scheduling, workload,
                        {.platform = platform, .duration = duration});
}

/// Simulates several executors.
inline Trace run(const TaskSet& set, std::span<const SimulatedExecutor> executors,
                 const std::vector<std::uint32_t>& executor_of, const ExecutionTimes& times,
                 const SimulationOptions& options) {
  PublishingWorkload workload(times);
  Trace trace;
  TraceRecorder recorder(trace);
  SimulationSummary summary = simulate(set, executors, executor_of, workload, options, &recorder);
  trace.end = summary.end;
  trace.published = std::move(summary.published);
  return trace;
}

/// A finished job, reduced to the fields that schedule tests compare.
struct Ran {
  TaskId task;
  std::uint64_t sequence;
  Duration start, finish;
  friend bool operator==(const Ran&, const Ran&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Ran& r) {
    return out << "{task " << r.task << " #" << r.sequence << " [" << r.start.count() << ", "
               << r.finish.count() << ")}";
  }
};

inline std::vector<Ran> schedule(const Trace& trace) {
  std::vector<Ran> jobs;
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran) continue;
    jobs.push_back({r.job.task, r.job.sequence, r.start - trace.epoch, r.finish - trace.epoch});
  }
  return jobs;
}

inline std::size_t count(const Trace& trace, TaskId task, Outcome outcome) {
  return static_cast<std::size_t>(std::ranges::count_if(
      trace.jobs, [&](const JobRecord& r) { return r.job.task == task && r.outcome == outcome; }));
}

inline std::uint64_t skipped(const Trace& trace, TaskId task) {
  std::uint64_t sum = 0;
  for (const JobRecord& r : trace.jobs) sum += r.job.task == task ? r.job.skipped : 0;
  return sum;
}

/// A name for a test: only letters, digits and underscores.
inline std::string identifier(std::string_view text) {
  std::string name(text);
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

inline std::vector<std::string_view> executor_names() {
  std::vector<std::string_view> names;
  for (const ExecutorEntry& executor : executors()) names.push_back(executor.name);
  return names;
}

/// The number in an environment variable.
inline std::uint64_t from_environment(const char* variable, std::uint64_t otherwise) {
  const char* given = std::getenv(variable);
  return given == nullptr ? otherwise : std::strtoull(given, nullptr, 10);
}

using Random = std::mt19937_64;

inline std::int64_t uniform(Random& random, std::int64_t lowest, std::int64_t highest) {
  return std::uniform_int_distribution<std::int64_t>(lowest, highest)(random);
}

/// `n` timers with periods of 5 to 50 ms, random phases, and a total utilisation of about
/// `utilisation`.
inline TaskSet random_timers(Random& random, int n, double utilisation) {
  TaskSet set;
  std::vector<double> share;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += share.emplace_back(static_cast<double>(uniform(random, 1, 100)));
  for (int i = 0; i < n; ++i) {
    // Some periods repeat, so that ties occur.
    const Duration period = uniform(random, 0, 3) == 0 ? 10ms : uniform(random, 5'000, 50'000) * 1us;
    const auto wcet_us = static_cast<std::int64_t>(static_cast<double>(period / 1us) * utilisation *
                                                   share[static_cast<std::size_t>(i)] / sum);
    const TaskId id = add_timer(set, period, wcet_us * 1us, uniform(random, 0, period / 1us) * 1us);
    set.tasks[id].bcet = set.tasks[id].wcet / 2;
    set.tasks[id].deadline = uniform(random, 1, 2 * (period / 1us)) * 1us;
    set.tasks[id].priority = uniform(random, 0, 5);
  }
  return set;
}

/// Random timers and `subscriptions` subscriptions to one to `largest_publishers` (1 or 2) publishers each.
inline TaskSet random_graph(Random& random, int timers, int subscriptions, double utilisation,
                            std::uint32_t largest_depth = 3, int largest_publishers = 2) {
  TaskSet set = random_timers(random, timers, utilisation / 2);
  for (int i = 0; i < subscriptions; ++i) {
    std::vector<TaskId> publishers = {static_cast<TaskId>(uniform(random, 0, set.size() - 1))};
    if (largest_publishers > 1 && uniform(random, 0, 3) == 0) {
      const auto second = static_cast<TaskId>(uniform(random, 0, set.size() - 1));
      if (second != publishers[0]) publishers.push_back(second);
    }
    const Duration wcet = uniform(random, 0, static_cast<std::int64_t>(utilisation * 4'000)) * 1us;
    const TaskId id = add_subscription(set, publishers, wcet,
                                       static_cast<std::uint32_t>(uniform(random, 1, largest_depth)));
    set.tasks[id].bcet = set.tasks[id].wcet / 2;
    if (uniform(random, 0, 1) == 0) set.tasks[id].priority = uniform(random, 0, 5);
  }
  return set;
}

}  // namespace hotpath::test
