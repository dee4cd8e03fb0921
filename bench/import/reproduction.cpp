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
struct Way {
  const RecordedSystem& recorded;
  const Interpretation& found;
  const std::vector<std::string>& labels;         // by executor
  const std::vector<ExecutorTraits>& traits;      // by executor
  const std::vector<std::uint32_t>& executor_of;  // by task
  const TimerThread timer_thread;

  [[nodiscard]] Reproduction reproduce() const {
    std::vector<bool> release_only;
    for (TaskId id = 0; id < executor_of.size(); ++id) {
      // The jobs decide where they contradict the executor, which may be inferred wrongly.
      const TimerHandling timers = traits[executor_of[id]].timers;
      release_only.push_back(timers == TimerHandling::release_only || found.timers.released[id]);
    }
    RecordedRows rows = recorded_rows(recorded, found.graph, found.timers, release_only);
    const RecordedWindow window{recorded.jobs, rows.jobs};
    const Displacement displacement = recorded_displacement(recorded.system, window);
    const auto timers_apart = [](const ExecutorTraits& of) {
      return of.timers == TimerHandling::release_and_execute;
    };
    const bool shared =
        labels.size() > 1 || (recorded.cores == 1 && std::ranges::any_of(traits, timers_apart));
    for (std::size_t i = 0; i < rows.jobs.size() && shared; ++i)
      if (rows.jobs[i].outcome == Outcome::ran) rows.jobs[i].cpu_time = displacement.own[i];
    Reproduction made;
    made.labels = labels;
    made.costs = costs_of(window);
    if (shared) made.slices = displacement.slices;
    made.trace = trace_of(rows);
    made.graph = graph_of(made.costs, made.trace);
    made.tasks = make_tasks(made.graph);
    made.executor = executor_for(displacement);
    made.trace.executor = made.executor.label;
    std::vector<ChainObservation> outputs = recorded_chains(recorded.system, found.graph, window);
    for (ChainObservation& o : outputs) {
      o.sink_start -= found.graph.epoch - Time{};
      o.latest_source_start -= found.graph.epoch - Time{};
    }
    made.trace.chains = join_chains(made.graph, made.tasks, made.trace, outputs);
    made.check = self_check(made.graph, made.tasks, made.executor, made.trace,
                            synchronised_chains(recorded, found.graph));
    return made;
  }

  std::vector<RecordedCosts> costs_of(const RecordedWindow& window) const {
    const auto measure = [&](const MeasuredCost& elsewhere) {
      std::vector<RecordedCosts> costs;
      for (std::size_t e = 0; e < traits.size(); ++e)
        costs.push_back(recorded_costs(found.graph, window, recorded.executors[e], traits[e], elsewhere));
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
      for (const std::uint32_t t : recorded.executors[e].threads) {
        const double weight = cost.n == 0 ? 0 : static_cast<double>(recorded.system.threads[t].jobs);
        sum += weight * static_cast<double>(cost.median.count());
        jobs += weight;
      }
    }
    return Duration(static_cast<std::int64_t>(jobs > 0 ? sum / jobs : 0));
  }

  /// The rows of tasks, relative to the epoch.
  Trace trace_of(const RecordedRows& rows) const {
    const TaskSet& set = found.graph.tasks.set;
    const Duration epoch = found.graph.epoch - Time{};
    Trace trace;
    trace.end = recorded.end - epoch;
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
    Graph graph = found.graph.graph;
    const GraphTasks& tasks = found.graph.tasks;
    std::vector<std::vector<Duration>> times(tasks.set.size());
    for (const JobRecord& r : working_jobs(tasks, trace).jobs) times[r.job.task].push_back(own_time(r));
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
    GraphPlatform platform = found.graph.graph.platform;
    platform.cores = recorded.cores;
    platform.timer_thread =
        timer_thread == TimerThread::raised ? TimerThread::raised : TimerThread::by_executor;
    platform.execution_times =
        are_correlated(times) ? ExecutionTimeModel::replayed : ExecutionTimeModel::measured;
    platform.timer_dispatch_cost = dispatch_of(TaskKind::timer);
    platform.subscription_dispatch_cost = dispatch_of(TaskKind::subscription);
    platform.wait_cost = mean(costs, [](const RecordedCosts& c) { return c.wait; });
    platform.wake_up_latency = mean(costs, [](const RecordedCosts& c) { return c.wake_up; });
    const MeasuredCost delivery = measured_delivery(costs);
    platform.measured_delivery = {delivery.greatest, delivery.median, static_cast<std::uint32_t>(delivery.n)};
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
    const SchedulerOptions defaults{.release = found.graph.graph.release};
    if (found.deployment) return setup::deploy(*found.deployment, defaults);
    if (labels.size() == 1 && timer_thread != TimerThread::equal)
      return setup::parse_executor(labels.front(), defaults);
    return setup::deploy(recorded_deployment(displacement), defaults);
  }

  /// The recorded threads. A trace has no policies: fifo stands for threads that preempted others.
  Deployment recorded_deployment(const Displacement& displacement) const {
    const bool several_processes = recorded.system.processes.size() > 1;
    const auto most = std::min<std::int64_t>(recorded.cores, kMaxProcessor + 1);
    Deployment deployment;
    deployment.name = "recorded";
    deployment.file = found.deployment_file;
    std::vector<std::string>& processes = deployment.processes;
    processes.clear();
    std::vector<std::uint32_t> place(labels.size());
    for (std::uint32_t e = 0; e < place.size(); ++e) {
      if (std::ranges::count(executor_of, e) == 0) continue;
      place[e] = static_cast<std::uint32_t>(deployment.executors.size());
      const RecordedExecutor& of = recorded.executors[e];
      DeployedExecutor& executor = deployment.executors.emplace_back();
      executor.name = of.name;
      executor.executor = labels[e];
      std::set<std::int32_t> processors;
      int level = timer_thread == TimerThread::equal ? 1 : 0;
      for (const std::uint32_t t : of.threads) {
        processors.insert(displacement.processors[t].begin(), displacement.processors[t].end());
        level = std::max(level, displacement.level[t]);
      }
      if (level > 0) executor.policy = {ThreadPolicy::Class::fifo, 10 * level};
      if (!processors.empty() && processors.size() < recorded.cores && *processors.begin() >= 0 &&
          *processors.rbegin() < most)
        executor.processors.assign(processors.begin(), processors.end());
      const std::string process = several_processes ? std::to_string(of.process) : "";
      if (std::ranges::count(processes, process) == 0) processes.push_back(process);
      executor.process =
          static_cast<std::uint32_t>(std::ranges::find(processes, process) - processes.begin());
    }
    for (const std::uint32_t e : executor_of) deployment.executor_of.push_back(place[e]);
    return deployment;
  }
};

/// The executor of each task; if it never ran, of its callback group, or of its node, or the first one.
std::vector<std::uint32_t> executors_of_tasks(const RecordedSystem& recorded, const RecordedGraph& graph) {
  const auto& [set, origin, callbacks, readers] = graph.tasks;
  std::vector<std::uint32_t> ran, all;
  for (const std::uint32_t c : graph.callback_of) ran.push_back(c == kNone ? kNone : recorded.executor_of[c]);
  for (TaskId id = 0; id < set.size(); ++id) {
    std::uint32_t of_group = ran[id], of_node = kNone;
    for (TaskId other = 0; other < set.size() && of_group == kNone; ++other) {
      if (origin[other].node != origin[id].node) continue;
      if (set[other].group == set[id].group) of_group = ran[other];
      if (of_node == kNone) of_node = ran[other];
    }
    all.push_back(of_group != kNone ? of_group : of_node != kNone ? of_node : 0);
  }
  return all;
}

}  // namespace

Reproduction reproduce(const RecordedSystem& recorded, const Interpretation& found,
                       const std::vector<std::string>& labels) {
  using enum TimerThread;
  std::vector<ExecutorTraits> traits;
  traits.reserve(labels.size());
  for (const std::string& label : labels) traits.push_back(setup::parse_executor(label, {}).entry->traits);
  const std::vector<std::uint32_t> executor_of = executors_of_tasks(recorded, found.graph);
  const auto reproduced = [&](const RecordedSystem& of, TimerThread timer_thread) {
    return Way{of, found, labels, traits, executor_of, timer_thread}.reproduce();
  };
  // Linux may let a timer thread that has slept preempt a busy one at once.
  const bool is_open = std::ranges::any_of(traits, [](const ExecutorTraits& of) {
    return of.timers != TimerHandling::polled && !of.raises_timer_thread;
  });
  const bool is_long = recorded.jobs.size() > kTried;
  const RecordedSystem few = is_long ? recorded.beginning(kTried) : recorded;
  Reproduction best;
  TimerThread of_best = by_executor;
  std::vector<std::pair<std::string, double>> tried;
  for (const auto& [timer_thread, name] :
       {std::pair(by_executor, "timer thread as the executor has it"),
        {raised, "raised timer thread"},
        {equal, "timer thread with the executor's priority of SCHED_FIFO"}}) {
    if (timer_thread != by_executor && (!is_open || (found.deployment && timer_thread == equal))) continue;
    Reproduction other = reproduced(few, timer_thread);
    const double similarity = other.check.schedule.similarity;
    if (is_open) tried.emplace_back(name, similarity);
    if (timer_thread != by_executor && similarity <= best.check.schedule.similarity) continue;
    of_best = timer_thread;
    best = std::move(other);
  }
  if (is_long) best = reproduced(recorded, of_best);
  best.tried = std::move(tried);
  return best;
}

}  // namespace hotpath::imports
