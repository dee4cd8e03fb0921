// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/simulator.hpp"

#include <iomanip>
#include <sstream>
#include <string>

#include "simulation.hpp"

namespace hotpath {

namespace {

void check(bool valid, const std::string& problem) {
  if (!valid) throw SimulationError(problem);
}

void check_task(const Task& task) {
  for (const Duration d : {task.period, task.phase, task.wcet, task.deadline}) {
    check(d >= Duration{} && d <= kLongestInstant,
          "task `" + task.name + "`: a period, phase, deadline or " +
              "execution time is negative or beyond 2^60 ns (36 years)");
  }
  check(task.kind != TaskKind::timer || task.period > Duration{},
        "task `" + task.name + "`: the period of a timer must be positive");
}

void check_options(const SimulationOptions& options) {
  const Platform& p = options.platform;
  check(p.cores >= 1, "a simulation needs at least one core");
  check(p.time_slice > Duration{}, "the time slice must be positive");
  const auto check_range = [](Duration d) {
    check(d >= Duration{} && d <= kLongestInstant,
          "costs, delays and latencies must be between 0 and 2^60 ns");
  };
  check_range(p.time_slice);
  for (const auto cost : kAllCosts) check_range(p.*cost);
  check(options.duration > Duration{}, "the duration must be positive");
  check(options.start >= Duration{} && options.start < options.duration,
        "the start of the executors must lie within the duration");
  check(options.duration <= kLongestInstant,
        "the duration exceeds 2^60 ns (36 years), beyond which instants would overflow");
}

}  // namespace

void check_simulation(const TaskSet& set, const SimulationOptions& options) {
  check_options(options);
  for (const Task& task : set.tasks) check_task(task);
}

void SimulatedWorkers::wake_sleeper(Worker w, Time now) {
  const State& s = states_[w];
  const Time until = std::min(s.until, now + (s.queues ? Duration{} : wake_up_latency_));
  until <= now ? make_ready(w, now) : sleep_until(w, until);
}

void Simulation::check_load(std::uint64_t waiting) const {
  const double load = utilisation(set_, summary_.published, now_ - Time{});
  const Duration per_job = platform_.release_cost + platform_.pass_cost + platform_.longest_dispatch_cost();
  const double costs = static_cast<double>(per_job.count()) * static_cast<double>(summary_.jobs + waiting) /
                       static_cast<double>(std::max<std::int64_t>((now_ - Time{}).count(), 1));
  if (waiting <= max_backlog_ && load + costs < 1) return;
  std::ostringstream message;
  message << std::fixed << std::setprecision(3) << "overload: more than "
          << (waiting > max_backlog_ ? max_backlog_ : overload_backlog_)
          << " released jobs are waiting to start after " << std::setprecision(1) << to_ms(now_ - Time{})
          << " ms; the utilisation is " << std::setprecision(3) << load
          << (per_job > Duration{} ? " without the platform's costs" : "")
          << "; keep it below 1, the capacity of one executor worker, shorten the run or raise the limit";
  throw SimulationError(message.str());
}

void Simulation::close() {
  now_ = end_ - Duration(1);
  while (!on_the_way_.empty()) arrive_next();
  if (!sink_) return;
  for (Worker w = 0; w < workers_.size(); ++w) {
    const SimulatedWorkers::State& worker = workers_[w];
    if (worker.step == Step::run) {
      end(w, Outcome::running);
    } else if ((worker.step == Step::release || worker.step == Step::dispatch) && worker.has_job &&
               !worker.record.job.empty) {
      sink_->ended({.job = worker.record.job, .outcome = Outcome::queued});  // decided, but not started
    }
  }
  for (const Executor& executor : executors_) {
    executor.scheduler->unfinished(
        now_, [&](const Job& job, Outcome outcome) { end_unstarted(executor, job, outcome); });
  }
}

SimulationSummary simulate(const TaskSet& set, Scheduler& scheduler, Workload& workload,
                           const SimulationOptions& options, JobSink* sink) {
  std::vector<SimulatedThread> threads(scheduler.workers().size());
  for (Worker w = 0; w < threads.size(); ++w) {
    const bool releaser = scheduler.workers()[w] == WorkerRole::timer_management;
    threads[w].priority = releaser && options.platform.raised_releaser ? 1 : 0;
  }
  const SimulatedExecutor executor{&scheduler, threads, options.platform.other_entities};
  return simulate(set, {&executor, 1}, std::vector<std::uint32_t>(set.size(), 0), workload, options, sink);
}

SimulationSummary simulate(const TaskSet& set, std::span<const SimulatedExecutor> executors,
                           const std::vector<std::uint32_t>& executor_of, Workload& workload,
                           const SimulationOptions& options, JobSink* sink) {
  check_simulation(set, options);
  return Simulation(set, executors, executor_of, workload, options, sink).run();
}

Trace simulate_trace(const TaskSet& set, const ExecutorEntry& executor, const SchedulerOptions& scheduling,
                     Workload& workload, const SimulationOptions& options) {
  Trace trace;
  trace.executor = executor.name;
  TraceRecorder recorder(trace);
  const auto scheduler = executor.make(set, scheduling);
  SimulationSummary summary = simulate(set, *scheduler, workload, options, &recorder);
  trace.end = summary.end;
  trace.published = std::move(summary.published);
  return trace;
}

double utilisation(const TaskSet& set, const std::vector<std::uint64_t>& published, Duration elapsed) {
  double sum = 0;
  for (TaskId id = 0; id < set.size(); ++id) {
    const Task& task = set[id];
    if (task.kind == TaskKind::timer) sum += to_ms(task.wcet) / to_ms(task.period);
    if (elapsed > Duration{}) sum += static_cast<double>(published[id]) * to_ms(task.wcet) / to_ms(elapsed);
  }
  return sum;
}

}  // namespace hotpath
