// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "import/hypothesis.hpp"
#include "import/recorded_steps.hpp"
#include "import/recorded_window.hpp"

namespace hotpath {

/// A recording, callback by callback: callback c is task c.
struct Recorded {
  tracing::System system;
  imports::RecordedGraph graph;
  std::vector<tracing::Job> jobs;
  std::vector<JobRecord> records;

  Recorded() {
    graph.tasks.set.groups.clear();
    system.nodes = {"/n"};
  }

  /// A task in a callback group of its own, or in that of the task before it.
  Task& task(TaskKind kind, Duration period = {}, bool same_group = false) {
    TaskSet& set = graph.tasks.set;
    Task& task = set.tasks.emplace_back();
    task.kind = kind;
    task.period = task.deadline = period;
    if (!same_group) set.groups.push_back(CallbackGroup::mutually_exclusive);
    task.group = static_cast<std::uint32_t>(set.groups.size() - 1);
    tracing::Callback& callback = system.callbacks.emplace_back();
    callback.kind =
        kind == TaskKind::timer ? tracing::CallbackKind::timer : tracing::CallbackKind::subscription;
    callback.period = period;
    callback.node = 0;
    graph.task_of.push_back(set.size() - 1);
    graph.callback_of.push_back(set.size() - 1);
    return task;
  }
  /// A timer that is first due at `phase`.
  void timer(Duration period, Duration phase) { task(TaskKind::timer, period).phase = phase; }

  /// Each thread has a processor of its own, unless they share processor 0.
  tracing::Job& job(TaskId task, std::uint32_t thread, Duration ready, Duration start, Duration finish,
                    bool shared = false) {
    tracing::Job& job = jobs.emplace_back();
    job.ref = {task, 0};
    job.thread = thread;
    job.processor = shared ? 0 : static_cast<std::int32_t>(thread);
    job.start = Time{} + start;
    job.finish = Time{} + finish;
    job.started = 2 * jobs.size();
    job.finished = 1000 + job.started;
    JobRecord& record = records.emplace_back();
    record.job.task = task;
    record.job.timestamp = Time{} + ready;
    return job;
  }

  imports::RecordedWindow window() const { return {jobs, records}; }
  imports::RecordedSteps steps() const {
    return imports::recorded_steps(graph, window(), {}, {"e", 0, {0}}, jobs.size());
  }
  /// All tasks in the order of their creation.
  imports::Hypothesis hypothesis(const char* executor) const {
    imports::Hypothesis h;
    h.label = executor;
    h.entry = find_executor(executor);
    for (TaskId id = 0; id < graph.tasks.set.size(); ++id) h.order.push_back(id);
    return h;
  }
  imports::Agreement follow(const char* executor) const {
    return imports::follow(graph.tasks.set, steps(), hypothesis(executor), 0, jobs.size());
  }
};

}  // namespace hotpath
