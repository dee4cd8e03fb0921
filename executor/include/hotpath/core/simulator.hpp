// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <stdexcept>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/worker.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath {

/// Parameters of a simulation.
struct SimulationOptions {
  Platform platform;
  Duration duration = std::chrono::seconds(10);  ///< > 0; the run is [0, duration).
  /// In [0, duration): when the executors begin to spin. Timers run from 0 on, like timers of nodes
  /// created before.
  Duration start{};
  /// Limits of released jobs waiting to start. Beyond the first, a system whose load so far is at
  /// least 1 counts as overloaded; beyond the second, any does. The simulation then stops with a
  /// SimulationError.
  std::uint64_t overload_backlog = 1'000'000, max_backlog = 1'000'000;
  const Deliveries* deliveries = nullptr;  ///< Without: each sample takes Platform::delivery_delay.
};

/// The result of a simulation without a sink.
struct SimulationSummary {
  std::uint64_t jobs = 0;                ///< Jobs that finished.
  std::vector<std::uint64_t> published;  ///< See Trace::published.
  Time end{};
};

/// Options or a task set cannot be simulated, or the backlog exceeds the limit. The message states
/// the problem and the remedy.
struct SimulationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Receives the record of every job while a simulation runs.
class JobSink {
 public:
  virtual ~JobSink() = default;

  /// A job starts: `finish` and `outcome` are not set yet. Not called for empty events.
  virtual void started(const JobRecord& /*record*/) {}

  /// The record is complete. Called as soon as the outcome is known: `ran` at the finish,
  /// `overwritten` at the delivery of the newer sample, `empty` when the event finds no sample,
  /// `queued` and `running` at the end of the run.
  virtual void ended(const JobRecord& record) = 0;
};

/// Collects the records of a simulation into a trace, ordered by start. A job that never starts is
/// placed at the instant that decided its outcome.
class TraceRecorder final : public JobSink {
 public:
  explicit TraceRecorder(Trace& trace) : trace_(trace) {}
  void started(const JobRecord& record) override {
    if (record.worker >= open_.size()) open_.resize(record.worker + 1U);
    open_[record.worker] = trace_.jobs.size();
    trace_.jobs.push_back(record);
  }
  void ended(const JobRecord& record) override {
    if (record.started()) {
      trace_.jobs[open_[record.worker]] = record;
    } else {
      trace_.jobs.push_back(record);
    }
  }

 private:
  Trace& trace_;
  std::vector<std::size_t> open_;  // by worker: index of the running job's record
};

/// Drives `scheduler`, created for `set` and not yet begun, through virtual time from 0 on. It
/// makes the calls of a live executor (take_turn, sample_arrived, finished) and decides nothing
/// itself. Memory does not grow with the duration. The same input gives the same result.
///
/// Order of events at one instant: running jobs finish and publish, delayed samples arrive,
/// sleeping workers wake, then workers take turns, in rounds by priority. With a raised releaser a
/// due timer is therefore released before the executor worker decides at the same instant.
///
/// At the end, samples in transit arrive, and jobs that have not started are recorded as `queued`.
/// Throws SimulationError, also for a duration so long that instants would overflow.
SimulationSummary simulate(const TaskSet& set, Scheduler& scheduler, Workload& workload,
                           const SimulationOptions& options, JobSink* sink = nullptr);

/// One of several executors of a simulation.
struct SimulatedExecutor {
  Scheduler* scheduler = nullptr;  ///< Created for the whole task set, in which only its own tasks are local,
                                   ///< or for a part of it.
  std::vector<SimulatedThread> threads;  ///< By worker.
  std::uint32_t other_entities = 0;      ///< Entities in its waits besides its tasks; see Platform.
  std::vector<TaskId> tasks = {};        ///< For a scheduler of a TaskPart: its tasks.
};

/// Simulates several executors on one machine; `executor_of` maps each task to its executor.
/// Workers are numbered consecutively across executors. Platform::raised_releaser has no effect,
/// because `threads` gives the priorities.
SimulationSummary simulate(const TaskSet& set, std::span<const SimulatedExecutor> executors,
                           const std::vector<std::uint32_t>& executor_of, Workload& workload,
                           const SimulationOptions& options, JobSink* sink = nullptr);

/// Simulates one executor of the registry and keeps the whole trace (epoch 0).
Trace simulate_trace(const TaskSet& set, const ExecutorEntry& executor, const SchedulerOptions& scheduling,
                     Workload& workload, const SimulationOptions& options);

/// Worst-case executor utilisation of a task set: the sum of WCET / period over the timers, plus,
/// for every subscription, its WCET times the rate at which `published` samples reached it within
/// `elapsed`.
double utilisation(const TaskSet& set, const std::vector<std::uint64_t>& published, Duration elapsed);

}  // namespace hotpath
