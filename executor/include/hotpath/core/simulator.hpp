// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <stdexcept>
#include <vector>

#include "hotpath/core/job_sink.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath {

struct SimulationOptions {
  Platform platform;
  Duration duration = std::chrono::seconds(10);  ///< > 0; the run is [0, duration).
  /// In [0, duration): when executors begin to spin. Timers run from 0 on, as those of nodes that were
  /// created before.
  Duration start{};
  /// Released jobs that may wait for their start before the system counts as overloaded; the simulation then
  /// stops with a SimulationError.
  std::uint64_t max_backlog = 1'000'000;
};

/// What remains of a simulation without a sink.
struct SimulationSummary {
  std::uint64_t jobs = 0;                ///< Jobs that ran to their end.
  std::vector<std::uint64_t> published;  ///< As Trace::published.
  Time end{};
};

/// Options or a task set that cannot be simulated, or a backlog beyond the limit; the message says what is
/// wrong and what would be right.
struct SimulationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Drives `scheduler`, made for `set` and not begun, through virtual time from 0 on, with the calls that a
/// live executor makes (take_turn, sample_arrived, finished) and decides nothing itself. Memory does not grow
/// with the duration. Same input, same result.
///
/// At one instant: first running jobs finish and publish, then delayed samples arrive, then sleeping workers
/// wake, then workers take turns, in rounds in the order of their priorities. With a raised releaser a timer
/// that is due is therefore released before a decision of the executor worker at the same instant.
///
/// At the end, samples still on their way arrive, and what has not started is recorded as `queued`.
/// Throws SimulationError, also for a duration so long that instants would overflow.
SimulationSummary simulate(const TaskSet& set, Scheduler& scheduler, Workload& workload,
                           const SimulationOptions& options, JobSink* sink = nullptr);

/// One of several executors of a simulation.
struct SimulatedExecutor {
  Scheduler* scheduler = nullptr;  ///< Made for the whole task set, of which its tasks are local, or a part.
  std::vector<SimulatedThread> threads;  ///< By worker.
  std::uint32_t other_entities = 0;      ///< In its waits, beside its tasks; see Platform.
  std::vector<TaskId> tasks = {};        ///< Of a scheduler for a TaskPart: its tasks.
};

/// The same with several executors on one machine, of which `executor_of` says, by task, which one serves it.
/// Their workers are numbered through. Platform::raised_releaser is of no effect: `threads` have priorities.
SimulationSummary simulate(const TaskSet& set, std::span<const SimulatedExecutor> executors,
                           const std::vector<std::uint32_t>& executor_of, Workload& workload,
                           const SimulationOptions& options, JobSink* sink = nullptr);

/// Simulates one executor of the registry and keeps the whole trace (epoch 0).
Trace simulate_trace(const TaskSet& set, const ExecutorEntry& executor, const SchedulerOptions& scheduling,
                     Workload& workload, const SimulationOptions& options);

/// Executor utilisation of a task set in the worst case: the sum of WCET / period over the timers, plus, for
/// every subscription, its WCET times the rate at which `published` samples reached it within `elapsed`.
double utilisation(const TaskSet& set, const std::vector<std::uint64_t>& published, Duration elapsed);

}  // namespace hotpath
