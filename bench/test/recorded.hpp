// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "import/recognition.hpp"

namespace hotpath {

/// A recorded system, callback by callback.
struct RecordedCallbacks {
  tracing::System system;
  std::vector<tracing::Job> jobs;

  /// A callback of a node, which may be new. Timers have a period of 10 ms.
  tracing::Callback& callback(tracing::CallbackKind kind, std::uint32_t node = 0,
                              std::uint32_t topic = tracing::kNone) {
    if (node == system.nodes.size()) system.nodes.push_back("/n" + std::to_string(node));
    const auto index = static_cast<std::uint32_t>(system.callbacks.size());
    if (topic != tracing::kNone) system.topics.at(topic).subscriptions.push_back(index);
    tracing::Callback& callback = system.callbacks.emplace_back();
    callback.kind = kind;
    callback.node = node;
    callback.topic = topic;
    if (kind == tracing::CallbackKind::timer) callback.period = std::chrono::milliseconds(10);
    return callback;
  }
  /// The next job of a callback.
  tracing::Job& job(std::uint32_t callback, std::uint32_t thread, Duration start, Duration finish) {
    tracing::Job& job = jobs.emplace_back();
    job.ref = {callback, system.callbacks.at(callback).jobs++};
    job.thread = thread;
    job.start = Time{} + start;
    job.finish = Time{} + finish;
    return job;
  }
  /// The graph, if one executor ran all callbacks but those in `of_none`.
  imports::RecordedGraph graph(const std::vector<std::uint32_t>& of_none = {}) const {
    std::vector<std::uint32_t> executor_of(system.callbacks.size(), 0);
    for (const std::uint32_t c : of_none) executor_of.at(c) = tracing::kNone;
    return imports::make_recorded_graph({.jobs = jobs, .executor_of = executor_of, .system = system}, "g");
  }
};

/// A recording whose callback c is task c.
struct Recorded : RecordedCallbacks {
  imports::RecordedGraph graph;
  std::vector<JobRecord> records;

  Recorded() { graph.tasks.set.groups.clear(); }

  /// A task in a callback group of its own, or in that of the task before it.
  Task& task(TaskKind kind, Duration period = {}, bool same_group = false) {
    const bool timer = kind == TaskKind::timer;
    callback(timer ? tracing::CallbackKind::timer : tracing::CallbackKind::subscription).period = period;
    TaskSet& set = graph.tasks.set;
    Task& task = set.tasks.emplace_back();
    task.kind = kind;
    task.period = task.deadline = period;
    if (!same_group) set.groups.push_back(CallbackGroup::mutually_exclusive);
    task.group = static_cast<std::uint32_t>(set.groups.size() - 1);
    graph.task_of.push_back(set.size() - 1);
    graph.callback_of.push_back(set.size() - 1);
    return task;
  }
  /// Timers, and then subscriptions, in groups of their own.
  void tasks(int timers, Duration period, int subscriptions = 0) {
    for (int i = 0; i < timers; ++i) task(TaskKind::timer, period);
    for (int i = 0; i < subscriptions; ++i) task(TaskKind::subscription);
  }
  /// A timer that is first due at `phase`.
  void timer(Duration period, Duration phase) { task(TaskKind::timer, period).phase = phase; }
  /// So many threads that `ran` so many jobs on these processors.
  void threads(std::size_t number, std::uint64_t ran = 1, const std::vector<std::int32_t>& processors = {0}) {
    tracing::Thread thread{0, 1, ran, 0, {}};
    for (const std::int32_t p : processors) thread.processors[p] = ran / processors.size();
    system.threads.assign(number, thread);
  }

  /// Each thread has a processor of its own, unless they share processor 0.
  tracing::Job& job(TaskId task, std::uint32_t thread, Duration ready, Duration start, Duration finish,
                    bool shared = false) {
    tracing::Job& job = RecordedCallbacks::job(task, thread, start, finish);
    job.ref.number = 0;
    job.processor = shared ? 0 : static_cast<std::int32_t>(thread);
    job.started = 2 * jobs.size();
    job.finished = 1000 + job.started;
    records.push_back({{task, 0, Time{} + ready, {}, kNever, {}}});
    return job;
  }

  imports::RecordedWindow window() const { return {jobs, records}; }
  imports::Displacement displacement() const { return imports::recorded_displacement(system, window()); }
  /// Of an executor with so many threads.
  imports::RecordedSteps steps(std::uint32_t threads = 1) const {
    return imports::recorded_steps(graph, window(), {}, executor(threads), jobs.size());
  }
  imports::RecordedCosts costs(const char* executor_name, std::uint32_t threads = 1) const {
    return imports::recorded_costs(graph, window(), executor(threads), find_executor(executor_name)->traits);
  }
  /// All tasks in the order of their creation.
  imports::Hypothesis hypothesis(const char* executor_name) const {
    imports::Hypothesis h;
    h.label = executor_name;
    h.entry = find_executor(executor_name);
    for (TaskId id = 0; id < graph.tasks.set.size(); ++id) h.order.push_back(id);
    return h;
  }
  imports::Agreement follow(const imports::Hypothesis& h, std::uint32_t threads = 1) const {
    return imports::follow(graph.tasks.set, steps(threads), h, 0, jobs.size());
  }

 private:
  static imports::RecordedExecutor executor(std::uint32_t threads) {
    imports::RecordedExecutor executor{"e", 0, {}};
    for (std::uint32_t t = 0; t < threads; ++t) executor.threads.push_back(t);
    return executor;
  }
};

}  // namespace hotpath
