// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "explain/causes.hpp"
#include "hotpath/core/platform.hpp"
#include "hotpath/core/priority_order.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "results/run_record.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath::explain {

/// An executor, as far as its decisions need to be named.
struct ServingExecutor {
  const ExecutorTraits& traits;
  Duration service_wait;                    ///< SchedulerOptions::service_wait.
  std::uint32_t first_worker, threads;      ///< The workers that run its jobs, one after the other.
  std::optional<PriorityOrder> order = {};  ///< Priority events queues.
  /// Simulated: the longest time from one job to the next that dispatch, wait, wake-up and releases
  /// can take. std::nullopt: not known.
  std::optional<Duration> most_overhead = {};
  Duration second_wake_up{};  ///< Of a timer's job: the timer thread wakes the thread that runs it.

  [[nodiscard]] bool many_threads() const { return threads > 1; }
};

/// What an explanation needs to know of a graph under one executor or deployment.
class System {
 public:
  /// `cores` of the machine. `tasks` must outlive the object. Throws as simulated::System does.
  System(const setup::ExecutorSpec& spec, const Graph& graph, const GraphTasks& tasks, results::RunKind kind,
         unsigned cores);

  [[nodiscard]] const Task& task(TaskId id) const { return tasks.set[id]; }
  [[nodiscard]] bool is_timer(TaskId id) const { return task(id).kind == TaskKind::timer; }
  [[nodiscard]] const ServingExecutor& executor_of(TaskId id) const {
    return executors_[setup::executor_of(spec_, id)];
  }
  /// Number of cores on which a worker may run; simulated.
  [[nodiscard]] unsigned cores_of(std::size_t worker) const;
  /// Whether a job on `other` that started at `other_start` keeps `worker`, busy since `since`, from
  /// the core that they share. With equal priorities, the job that started later has the core.
  [[nodiscard]] bool outranks(std::size_t other, Time other_start, std::size_t worker, Time since) const;
  /// Whether the tasks' jobs never overlap, because they share a callback group.
  [[nodiscard]] bool share_group(TaskId a, TaskId b) const;

  const GraphTasks& tasks;
  const results::RunKind kind;
  const bool simulated;
  const Duration delivery;     ///< From publication to arrival; simulated.
  const bool wall_clock_work;  ///< Jobs work until an instant of the clock.
  const std::vector<ChainIndex> chains;

 private:
  const std::uint64_t cores_;  // of the machine, as bits
  std::vector<ServingExecutor> executors_;
  const setup::ExecutorSpec spec_;
  std::vector<SimulatedThread> threads_;  // by worker; simulated
};

/// A started job. A job that was running at the end of the run has the finish kNever.
struct Seen {
  JobRecord record;
  std::uint64_t order = 0;  ///< Counts the started jobs of the repetition, in order of start.
};

/// The started jobs of one repetition that ended recently, by task and by worker.
class JobWindow {
 public:
  explicit JobWindow(TaskId tasks) : by_task_(tasks) {}

  /// Adds a started job, in order of start, and returns it; valid until it is forgotten.
  const Seen& add(const JobRecord& record);
  /// Forgets jobs that finished before `horizon`.
  void forget_before(Time horizon);
  void clear();

  /// nullptr: not in the window.
  [[nodiscard]] const Seen* find(JobRef job) const;
  /// In order of start.
  [[nodiscard]] const std::deque<Seen>& of_task(TaskId task) const { return by_task_[task]; }
  /// The jobs of a worker that ran at some time in [from, to), in order of start.
  [[nodiscard]] std::vector<const Seen*> of_worker(std::size_t worker, Time from, Time to) const;
  /// The same of all other workers, by worker.
  [[nodiscard]] std::vector<const Seen*> beside(std::size_t worker, Time from, Time to) const;

 private:
  std::vector<std::deque<Seen>> by_task_, by_worker_;
  std::uint64_t next_order_ = 0;
};

/// Follows the data of a chain's outputs backwards through recorded jobs.
class DataPath {
 public:
  /// `chain`: nullptr if no path will be asked for.
  DataPath(const System& system, const JobWindow& window, const ChainIndex* chain);

  /// Notes the sets that a started job completes. Jobs are added in order of start.
  void add(const Seen& job);
  /// Forgets all jobs.
  void clear();

  /// The jobs that carried the data of a source's job with the start or timestamp `source` to `sink`, in
  /// order. Where several ways lead there, the one whose data came last. Empty: there is no way.
  [[nodiscard]] std::vector<const Seen*> from_source(const Seen& sink, Time source, bool by_start);

 private:
  static constexpr std::size_t kOwn = ~std::size_t{0};  ///< The sample that a job took, not a publication.
  /// A set of the sink's node, with the inputs that have a sample.
  struct Set {
    Publication what;
    std::set<std::uint32_t> inputs;
  };
  using Message = std::pair<std::uint64_t, std::size_t>;  // Seen::order and publication

  [[nodiscard]] const std::vector<Publication>& publications_of(const Seen& job) const {
    return system_.tasks.callbacks[job.record.job.task].publishes;
  }
  [[nodiscard]] std::vector<std::size_t> messages_of(const Seen& sink) const;
  bool reach(const Seen& job, std::size_t publication);
  [[nodiscard]] std::vector<const Seen*> stored_for(const Seen& job, const Publication& message) const;
  [[nodiscard]] const Seen* last_stored(TaskId input, const Seen& job, const Publication& message) const;

  const System& system_;
  const JobWindow& window_;
  const ChainIndex* const chain_;
  std::vector<Set> sets_;
  std::set<Message> completed_;
  // Of the current search:
  Time source_{};
  bool by_start_ = true;
  std::set<Message> visited_;
  std::vector<const Seen*> path_;  // from the source on
};

/// Divides the latency of an output from `begin` on among causes: of the hot path, to the start of the last
/// job of the path; else to its finish, with the first job's wait. Of a response time, the path is the job.
/// Part::step is an index into `path`. `times`: of every job that works, in a simulation; nullptr: not known.
[[nodiscard]] std::vector<Part> parts_of_path(const System& system, const JobWindow& window,
                                              const ExecutionTimes* times,
                                              const std::vector<const Seen*>& path, Time begin,
                                              Latency latency);

/// One latency to explain.
struct Output {
  std::uint32_t repetition = 0;
  std::uint64_t sequence = 0;  ///< Of the sink's job, or of the task's.
  Duration latency{};          ///< As measured, >= 0.
  TaskId sink = kNoTask;       ///< The task of that job.
};

/// The output at a quantile in [0, 1]: the smallest that at least this share of outputs do not
/// exceed. `outputs` must not be empty.
[[nodiscard]] const Output& at_quantile(const std::vector<Output>& by_latency, double quantile);
[[nodiscard]] std::vector<Output> sorted_by_latency(std::vector<Output> outputs);

/// Explains outputs while it reads the jobs of a run.
class Explainer {
 public:
  using Use = std::function<void(const Explanation&)>;

  /// `chain`: index into System::chains; none: response times of the outputs' tasks. `system` must outlive
  /// the object.
  Explainer(const System& system, std::optional<std::uint32_t> chain, std::vector<Output> outputs, Use use,
            Latency latency = Latency::response);

  void begin(std::uint32_t repetition, const ExecutionTimes* times);
  /// Adds a job of this repetition; started jobs in order of start.
  void add(const JobRecord& record);
  void end();

  [[nodiscard]] Time last_start() const { return now_; }
  /// Outputs whose job is not in the trace.
  [[nodiscard]] std::size_t missing() const { return outputs_.size() - explained_; }

 private:
  void explain_finished();
  void explain_output(const Seen& job, Duration latency);
  [[nodiscard]] std::vector<const Seen*> of_triggers(const Seen& sink, Time begin) const;

  const System& system_;
  const ChainIndex* const chain_;  // nullptr: response times
  const Latency latency_;
  std::vector<Output> outputs_;  // by repetition, task and sequence
  const Use use_;
  JobWindow window_;
  DataPath paths_;
  Duration longest_{};  // of the outputs
  std::uint32_t repetition_ = 0;
  const ExecutionTimes* times_ = nullptr;
  /// Jobs of outputs, explained when all jobs that overlap are known, and the latencies.
  std::vector<std::pair<Seen, Duration>> unfinished_;
  std::size_t explained_ = 0, added_ = 0;
  Time now_ = Time::min();
};

}  // namespace hotpath::explain
