// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <set>

#include "hotpath/reference_system/graph_workload.hpp"
#include "import/stages.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::imports {

namespace {

/// Execution times with a first autocorrelation above this are not independent, from so many on.
constexpr double kCorrelated = 0.1;
constexpr std::size_t kFewestTimes = 20;

/// One way to reproduce a recording. `timer_thread`: how the thread that releases timers stands to the other
/// one. `equal`: both have one priority of SCHED_FIFO, so that it waits until the other sleeps.
class Way {
 public:
  Way(const RecordedSystem& recorded, const Interpretation& found, const std::vector<std::string>& labels,
      const std::string& deployment_file, TimerThread timer_thread)
      : recorded_(recorded),
        found_(found),
        labels_(labels),
        deployment_file_(deployment_file),
        timer_thread_(timer_thread) {
    for (const std::string& label : labels) traits_.push_back(setup::parse_executor(label, {}).entry->traits);
    for (TaskId id = 0; id < found.graph.tasks.set.size(); ++id) executor_of_.push_back(executor_of(id));
  }

  [[nodiscard]] Reproduction reproduce() const {
    std::vector<bool> release_only;
    for (TaskId id = 0; id < executor_of_.size(); ++id) {
      // The jobs decide where they contradict the executor, which may be inferred wrongly.
      const TimerHandling timers = traits_[executor_of_[id]].timers;
      release_only.push_back(timers == TimerHandling::release_only || found_.timers.released[id]);
    }
    RecordedRows rows = recorded_rows(recorded_, found_.graph, found_.timers, release_only);
    const RecordedWindow window{recorded_.jobs, rows.jobs};
    const Displacement displacement = recorded_displacement(recorded_.system, window);
    const bool shared = processors_are_shared();
    for (std::size_t i = 0; i < rows.jobs.size() && shared; ++i)
      if (rows.jobs[i].outcome == Outcome::ran) rows.jobs[i].cpu_time = displacement.own[i];
    Reproduction made;
    made.labels = labels_;
    made.costs = costs_of(window);
    if (shared) made.slices = displacement.slices;
    made.trace = trace_of(rows);
    made.graph = graph_of(made.costs, made.trace);
    made.tasks = make_tasks(made.graph);
    made.executor = executor_for(displacement);
    made.trace.executor = made.executor.label;
    std::vector<ChainObservation> outputs = recorded_chains(recorded_.system, found_.graph, window);
    for (ChainObservation& o : outputs) {
      o.sink_start -= found_.graph.epoch - Time{};
      o.latest_source_start -= found_.graph.epoch - Time{};
    }
    made.trace.chains = join_chains(made.graph, made.tasks, made.trace, outputs);
    made.check = self_check(made.graph, made.tasks, made.executor, made.trace,
                            synchronised_chains(recorded_, found_.graph));
    return made;
  }

  /// Whether Linux may let the timer thread, which has slept, preempt a busy one at once.
  [[nodiscard]] bool may_be_raised() const {
    return std::ranges::any_of(traits_, [](const ExecutorTraits& traits) {
      return traits.timers != TimerHandling::polled && !traits.raises_timer_thread;
    });
  }

 private:
  /// The executor of a task; if it never ran, of its callback group, or of its node, or the first one.
  std::uint32_t executor_of(TaskId id) const {
    const GraphTasks& tasks = found_.graph.tasks;
    const auto recorded = [&](TaskId task) {
      const std::uint32_t c = found_.graph.callback_of[task];
      return c == kNone ? kNone : recorded_.executor_of[c];
    };
    if (recorded(id) != kNone) return recorded(id);
    std::uint32_t of_node = kNone;
    for (TaskId other = 0; other < tasks.set.size(); ++other) {
      if (recorded(other) == kNone || tasks.origin[other].node != tasks.origin[id].node) continue;
      if (tasks.set[other].group == tasks.set[id].group) return recorded(other);
      if (of_node == kNone) of_node = recorded(other);
    }
    return of_node == kNone ? 0 : of_node;
  }

  bool processors_are_shared() const {
    const bool timers_apart = std::ranges::any_of(traits_, [](const ExecutorTraits& traits) {
      return traits.timers == TimerHandling::release_and_execute;
    });
    return labels_.size() > 1 || (timers_apart && recorded_.cores == 1);
  }

  std::vector<RecordedCosts> costs_of(const RecordedWindow& window) const {
    const auto measure = [&](const MeasuredCost& elsewhere) {
      std::vector<RecordedCosts> costs;
      for (std::size_t e = 0; e < traits_.size(); ++e)
        costs.push_back(recorded_costs(found_.graph, window, recorded_.executors[e], traits_[e], elsewhere));
      return costs;
    };
    std::vector<RecordedCosts> costs = measure({});
    if (std::ranges::all_of(costs, [](const RecordedCosts& c) { return c.dispatch.n > 0; })) return costs;
    return measure({.median = mean(costs, [](const RecordedCosts& c) { return c.dispatch; })});
  }

  /// The mean of the executors' medians, weighted by jobs.
  template <class Cost>
  Duration mean(const std::vector<RecordedCosts>& costs, const Cost& cost_of) const {
    double sum = 0, jobs = 0;
    for (std::size_t e = 0; e < costs.size(); ++e) {
      const MeasuredCost cost = cost_of(costs[e]);
      for (const std::uint32_t t : recorded_.executors[e].threads) {
        const double weight = cost.n == 0 ? 0 : static_cast<double>(recorded_.system.threads[t].jobs);
        sum += weight * static_cast<double>(cost.median.count());
        jobs += weight;
      }
    }
    return Duration(static_cast<std::int64_t>(jobs > 0 ? sum / jobs : 0));
  }

  /// The rows of tasks, relative to the epoch.
  Trace trace_of(const RecordedRows& rows) const {
    const TaskSet& set = found_.graph.tasks.set;
    const Duration epoch = found_.graph.epoch - Time{};
    Trace trace;
    trace.end = recorded_.end - epoch;
    trace.published.resize(set.size());
    for (const auto* part : {&rows.jobs, &rows.others}) {
      for (JobRecord r : *part) {
        if (r.job.task == kNoTask) continue;
        if (r.started()) r.start -= epoch;
        if (r.outcome == Outcome::ran) r.finish -= epoch;
        r.job.timestamp -= epoch;
        r.job.release -= epoch;
        if (r.job.deadline != kNever) r.job.deadline -= epoch;
        if (set[r.job.task].kind == TaskKind::subscription) ++trace.published[r.job.task];
        trace.jobs.push_back(r);
      }
    }
    return trace;
  }

  /// The graph with the platform, and with the execution times of the jobs that worked, in order.
  Graph graph_of(const std::vector<RecordedCosts>& costs, const Trace& trace) const {
    Graph graph = found_.graph.graph;
    const GraphTasks& tasks = found_.graph.tasks;
    std::vector<std::vector<Duration>> times(tasks.set.size());
    for (const JobRecord& r : working_jobs(tasks, trace).jobs)
      times[r.job.task].push_back(r.cpu_time >= Duration{} ? r.cpu_time : r.duration());
    graph.platform = platform_of(costs, times);
    for (TaskId id = 0; id < times.size(); ++id) {
      if (times[id].empty()) continue;
      Callback& callback = callback_of_task(graph, tasks.origin[id]);
      const auto [least, most] = std::ranges::minmax(times[id]);
      callback.best = least;
      callback.worst = most;
      callback.measured = std::make_shared<const std::vector<Duration>>(std::move(times[id]));
    }
    return graph;
  }

  GraphPlatform platform_of(const std::vector<RecordedCosts>& costs,
                            const std::vector<std::vector<Duration>>& times) const {
    const auto dispatch_of = [&](TaskKind kind) {
      return mean(costs, [kind](const RecordedCosts& c) { return c.dispatch_of(kind); });
    };
    GraphPlatform platform = found_.graph.graph.platform;
    platform.cores = recorded_.cores;
    platform.timer_thread =
        timer_thread_ == TimerThread::raised ? TimerThread::raised : TimerThread::by_executor;
    platform.execution_times =
        are_correlated(times) ? ExecutionTimeModel::replayed : ExecutionTimeModel::measured;
    platform.timer_dispatch_cost = dispatch_of(TaskKind::timer);
    platform.subscription_dispatch_cost = dispatch_of(TaskKind::subscription);
    platform.wait_cost = mean(costs, [](const RecordedCosts& c) { return c.wait; });
    platform.wake_up_latency = mean(costs, [](const RecordedCosts& c) { return c.wake_up; });
    platform.measured_delivery = measured_delivery(costs).greatest;
    return platform;
  }

  /// Whether execution times depend on the previous job of the task, by the first autocorrelation,
  /// weighted by work. Independent draws would lose this.
  static bool are_correlated(const std::vector<std::vector<Duration>>& all_times) {
    double correlated = 0, work = 0;
    for (const std::vector<Duration>& times : all_times) {
      if (times.size() < kFewestTimes) continue;
      double sum = 0, square = 0, next = 0;
      for (const Duration t : times) sum += to_ms(t);
      const double mean = sum / static_cast<double>(times.size());
      for (std::size_t i = 0; i < times.size(); ++i) {
        square += (to_ms(times[i]) - mean) * (to_ms(times[i]) - mean);
        if (i > 0) next += (to_ms(times[i]) - mean) * (to_ms(times[i - 1]) - mean);
      }
      if (square > 0) correlated += sum * next / square;
      work += sum;
    }
    return correlated > kCorrelated * work;
  }

  setup::ExecutorSpec executor_for(const Displacement& displacement) const {
    if (found_.deployment) return setup::deploy(*found_.deployment, {});
    if (labels_.size() == 1 && timer_thread_ != TimerThread::equal)
      return setup::parse_executor(labels_.front(), {});
    return setup::deploy(recorded_deployment(displacement), {});
  }

  /// The recorded threads. A trace has no policies: fifo stands for threads that preempted others.
  Deployment recorded_deployment(const Displacement& displacement) const {
    Deployment deployment;
    deployment.name = "recorded";
    deployment.file = deployment_file_;
    deployment.processes.clear();
    std::vector<std::uint32_t> place(labels_.size());
    for (std::uint32_t e = 0; e < place.size(); ++e) {
      if (std::ranges::count(executor_of_, e) == 0) continue;
      place[e] = static_cast<std::uint32_t>(deployment.executors.size());
      deployment.executors.push_back(deployed(e, displacement, deployment.processes));
    }
    for (const std::uint32_t e : executor_of_) deployment.executor_of.push_back(place[e]);
    return deployment;
  }

  DeployedExecutor deployed(std::uint32_t e, const Displacement& displacement,
                            std::vector<std::string>& processes) const {
    const RecordedExecutor& recorded = recorded_.executors[e];
    DeployedExecutor executor;
    executor.name = recorded.name;
    executor.executor = labels_[e];
    std::set<std::int32_t> processors;
    int level = timer_thread_ == TimerThread::equal ? 1 : 0;
    for (const std::uint32_t t : recorded.threads) {
      processors.insert(displacement.processors[t].begin(), displacement.processors[t].end());
      level = std::max(level, displacement.level[t]);
    }
    if (level > 0) executor.policy = {ThreadPolicy::Class::fifo, 10 * level};
    const auto most = std::min<std::int64_t>(recorded_.cores, kMaxProcessor + 1);
    const bool bound = !processors.empty() && processors.size() < recorded_.cores &&
                       *processors.begin() >= 0 && *processors.rbegin() < most;
    if (bound) executor.processors.assign(processors.begin(), processors.end());
    const bool several = recorded_.system.processes.size() > 1;
    const std::string process = several ? std::to_string(recorded.process) : "";
    if (std::ranges::count(processes, process) == 0) processes.push_back(process);
    executor.process = static_cast<std::uint32_t>(std::ranges::find(processes, process) - processes.begin());
    return executor;
  }

  const RecordedSystem& recorded_;
  const Interpretation& found_;
  const std::vector<std::string>& labels_;  // by executor
  const std::string& deployment_file_;
  const TimerThread timer_thread_;
  std::vector<ExecutorTraits> traits_;      // by executor
  std::vector<std::uint32_t> executor_of_;  // by task
};

}  // namespace

Reproduction reproduce(const RecordedSystem& recorded, const Interpretation& found,
                       const std::vector<std::string>& labels, const std::string& deployment_file) {
  using enum TimerThread;
  const bool is_long = recorded.jobs.size() > kTried;
  const RecordedSystem few = is_long ? recorded.beginning(kTried) : recorded;
  const auto way = [&](const RecordedSystem& of, TimerThread timer_thread) {
    return Way(of, found, labels, deployment_file, timer_thread);
  };
  Reproduction best = way(few, by_executor).reproduce();
  TimerThread of_best = by_executor;
  std::vector<std::pair<std::string, double>> tried;
  const auto similarity = [](const Reproduction& r) { return r.check.schedule.similarity; };
  if (way(few, by_executor).may_be_raised()) {
    tried.emplace_back("timer thread as the executor has it", similarity(best));
    for (const auto& [timer_thread, name] :
         {std::pair(raised, "raised timer thread"),
          std::pair(equal, "timer thread with the executor's priority of SCHED_FIFO")}) {
      if (found.deployment && timer_thread == equal) continue;
      Reproduction other = way(few, timer_thread).reproduce();
      tried.emplace_back(name, similarity(other));
      if (similarity(other) <= similarity(best)) continue;
      of_best = timer_thread;
      best = std::move(other);
    }
  }
  if (is_long) best = way(recorded, of_best).reproduce();
  best.tried = std::move(tried);
  return best;
}

}  // namespace hotpath::imports
