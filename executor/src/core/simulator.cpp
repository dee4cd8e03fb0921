// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/simulator.hpp"

#include <algorithm>
#include <deque>
#include <iomanip>
#include <span>
#include <sstream>
#include <string>

#include "simulated_workers.hpp"

namespace hotpath {

namespace {

// Instants and durations of a simulation do not exceed this limit, so that sums of a few of them
// fit into 63 bits.
constexpr Duration kLongest{std::int64_t{1} << 60};  // 36 years

void check(bool valid, const std::string& problem) {
  if (!valid) throw SimulationError(problem);
}

void check_task(const Task& task) {
  for (const Duration d : {task.period, task.phase, task.wcet, task.deadline}) {
    check(d >= Duration{} && d <= kLongest, "task `" + task.name + "`: a period, phase, deadline or " +
                                                "execution time is negative or beyond 2^60 ns (36 years)");
  }
  check(task.kind != TaskKind::timer || task.period > Duration{},
        "task `" + task.name + "`: the period of a timer must be positive");
}

void check_options(const SimulationOptions& options) {
  const Platform& p = options.platform;
  check(p.cores >= 1, "a simulation needs at least one core");
  check(p.time_slice > Duration{}, "the time slice must be positive");
  for (const Duration d : {p.release_cost, p.pass_cost, p.dispatch_cost, p.wait_cost, p.wait_cost_per_entity,
                           p.delivery_delay, p.wake_up_latency, p.time_slice}) {
    check(d >= Duration{} && d <= kLongest, "costs, delays and latencies must be between 0 and 2^60 ns");
  }
  check(options.duration > Duration{}, "the duration must be positive");
  check(options.start >= Duration{} && options.start < options.duration,
        "the start of the executors must lie within the duration");
  check(options.duration <= kLongest,
        "the duration exceeds 2^60 ns (36 years), beyond which instants would overflow");
}

class Simulation {
 public:
  Simulation(const TaskSet& set, std::span<const SimulatedExecutor> executors,
             const std::vector<std::uint32_t>& executor_of, Workload& workload,
             const SimulationOptions& options, JobSink* sink)
      : set_(set),
        executor_of_(executor_of),
        workload_(workload),
        platform_(options.platform),
        start_(options.start),
        end_(Time{} + options.duration),
        max_backlog_(options.max_backlog),
        sink_(sink),
        workers_(options.platform) {
    for (const SimulatedExecutor& e : executors) {
      const auto roles = e.scheduler->workers();
      assert(e.threads.size() == roles.size());
      Executor& executor = executors_.emplace_back();
      executor.scheduler = e.scheduler;
      executor.tasks = e.tasks;
      executor.first = workers_.size();
      executor.other_entities = e.other_entities;
      executor.events = std::find(roles.begin(), roles.end(), WorkerRole::timer_management) != roles.end();
      for (Worker w = 0; w < roles.size(); ++w) {
        workers_.add(static_cast<std::uint32_t>(executors_.size() - 1), w, e.threads[w]);
      }
    }
    for (const SimulatedExecutor& e : executors) {
      if (!e.tasks.empty()) numbers_.resize(set.size());
      for (TaskId number = 0; number < e.tasks.size(); ++number) numbers_[e.tasks[number]] = number;
    }
    summary_.published.resize(set.size());
    arrived_.resize(set.size());
    summary_.end = end_;
  }

  SimulationSummary run() {
    for (const Executor& executor : executors_) executor.scheduler->begin(Time{});
    now_ = Time{} + start_;
    for (Worker w = 0; w < workers_.size(); ++w) workers_.make_ready(w, now_);
    take_steps();
    for (;;) {
      Time next = workers_.next_instant(now_);
      if (!on_the_way_.empty()) next = std::min(next, on_the_way_.front().arrival);
      if (next >= end_) break;
      now_ = next;
      finish_jobs();
      while (!on_the_way_.empty() && on_the_way_.front().arrival <= now_) arrive_next();
      workers_.wake_sleepers(now_);
      take_steps();
    }
    close();
    return std::move(summary_);
  }

 private:
  using Step = SimulatedWorkers::Step;

  struct Executor {
    Scheduler* scheduler = nullptr;
    std::span<const TaskId> tasks;
    Worker first = 0;  ///< Number of the executor's first worker.
    bool events = false;
    std::uint32_t other_entities = 0;
    std::optional<Worker> lock_holder;
    std::uint64_t timers_waiting = 0, events_waiting = 0;
  };

  struct Sample {
    Time arrival;
    TaskId subscription;
    SampleInfo info;
  };

  /// Jobs that end now finish before anything else happens at this instant, even if a woken worker
  /// of higher priority takes their core.
  void finish_jobs() {
    done_.clear();
    for (std::size_t i = 0; i < workers_.on_core(); ++i) {
      const Worker w = workers_.running(i);
      if (workers_[w].step == Step::run && workers_[w].until <= now_) done_.push_back(w);
    }
    std::sort(done_.begin(), done_.end());
    for (const Worker w : done_) finish_job(w);
  }

  Executor& executor_of(Worker w) { return executors_[workers_[w].executor]; }

  /// Translates a scheduler's job to the task's number in the whole set.
  static Job of_whole_set(const Executor& executor, Job job) {
    if (!executor.tasks.empty()) job.task = executor.tasks[job.task];
    return job;
  }
  /// The task's number in the scheduler that serves it.
  TaskId number_there(TaskId task) const { return numbers_.empty() ? task : numbers_[task]; }

  void wake(const Executor& executor, WorkerSet numbers) {
    while (!numbers.empty()) workers_.wake(executor.first + numbers.pop_first(), now_);
  }

  /// Runs all steps of this instant, in rounds: after the release of one timer, the woken worker
  /// decides before the next timer is released, if that worker has a core.
  void take_steps() {
    workers_.rotate_expired(now_);
    for (bool stepped = true; stepped;) {
      stepped = false;
      for (std::size_t i = 0; i < workers_.on_core(); ++i) {
        const Worker w = workers_.running(i);
        if (workers_[w].until > now_) continue;
        step(w);
        stepped = true;
      }
    }
  }

  void step(Worker w) {
    switch (workers_[w].step) {
      case Step::turn:
        return turn(w);
      case Step::release:
        unlock(w);
        return follow(w);
      case Step::dispatch:
        return start_job(w);
      case Step::run:
        return finish_job(w);
      case Step::asleep:
      case Step::blocked:
        assert(false && "a worker without anything to do has no core");
    }
  }

  void turn(Worker w) {
    SimulatedWorkers::State& worker = workers_[w];
    Executor& executor = executor_of(w);
    if (executor.lock_holder) {
      worker.step = Step::blocked;
      workers_.leave(w, now_);
      const Worker holder = *executor.lock_holder;
      if (workers_[holder].priority < worker.priority) {
        workers_.change_priority(holder, worker.priority, now_);
      }
      return;
    }
    worker.woken = false;
    const Turn turn = take_turn(*executor.scheduler, worker.number, now_);
    worker.has_job = turn.decision.job.has_value();
    if (worker.has_job) worker.job = of_whole_set(executor, *turn.decision.job);
    worker.wake_at = turn.decision.wake_at;
    worker.to_wake = turn.decision.wake;
    if (executor.events) count_backlog(worker, turn.released);
    const Duration cost = cost_under_lock(worker, turn);
    if (cost > Duration{}) {
      executor.lock_holder = w;
      return workers_.begin_step(w, Step::release, cost, now_);
    }
    follow(w);
  }

  Duration cost_under_lock(SimulatedWorkers::State& worker, const Turn& turn) const {
    Duration cost{};
    if (turn.released > 0) {
      cost += platform_.release_cost * turn.released;
      if (!worker.in_pass) cost += platform_.pass_cost;
      worker.in_pass = true;
    }
    if (worker.has_job && turn.decision.waited_for > 0) {
      const std::uint32_t others = executors_[worker.executor].other_entities;
      cost += platform_.wait_cost + platform_.wait_cost_per_entity * (turn.decision.waited_for + others);
    }
    return cost;
  }

  void unlock(Worker w) {
    Executor& executor = executor_of(w);
    executor.lock_holder.reset();
    workers_.change_priority(w, workers_[w].thread.priority, now_);
    const auto end = executor.first + static_cast<Worker>(executor.scheduler->workers().size());
    for (Worker other = executor.first; other < end; ++other) {
      if (workers_[other].step == Step::blocked) workers_.make_ready(other, now_);
    }
  }

  /// The part of the live loop after the lock is released.
  void follow(Worker w) {
    SimulatedWorkers::State& worker = workers_[w];
    wake(executor_of(w), worker.to_wake);
    if (worker.has_job) {
      worker.in_pass = false;
      workers_.begin_step(w, Step::dispatch, platform_.dispatch_cost, now_);
      if (worker.on_core && platform_.dispatch_cost == Duration{}) start_job(w);
    } else if (worker.woken || worker.wake_at <= now_) {
      again(w);
    } else {
      worker.in_pass = false;
      workers_.sleep(w, worker.wake_at, now_);
    }
  }

  void again(Worker w) { workers_.begin_step(w, Step::turn, Duration{}, now_); }

  void start_job(Worker w) {
    SimulatedWorkers::State& worker = workers_[w];
    const Job& job = worker.job;
    worker.start = now_;
    if (job.empty) {
      if (sink_) sink_->ended(record(w, Outcome::empty));
      done(w);
      return;
    }
    const Duration time = workload_.start(job, now_);
    if (time < Duration{} || time > kLongest) {
      throw SimulationError("the execution time of a job of task `" + set_[job.task].name +
                            "` must be between 0 and 2^60 ns");
    }
    workers_.begin_step(w, Step::run, time, now_);
    if (sink_) sink_->started(record(w, Outcome::ran));
  }

  void finish_job(Worker w) {
    const Job& job = workers_[w].job;
    ++summary_.jobs;
    if (sink_) sink_->ended(record(w, Outcome::ran));
    const std::span<const TaskId> reached = workload_.finish(job, set_[job.task], now_);
    if (!reached.empty()) publish(job, reached);
    done(w);
  }

  void done(Worker w) {
    again(w);
    const Executor& executor = executor_of(w);
    Job job = workers_[w].job;
    job.task = number_there(job.task);
    wake(executor, executor.scheduler->finished(workers_[w].number, job, now_).wake);
  }

  void publish(const Job& job, std::span<const TaskId> reached) {
    const SampleInfo info{now_, job.deadline, job.ref()};
    for (const TaskId subscription : reached) {
      ++summary_.published[subscription];
      if (platform_.delivery_delay > Duration{}) {
        on_the_way_.push_back({now_ + platform_.delivery_delay, subscription, info});
      } else {
        arrive({now_, subscription, info});
      }
    }
  }

  void arrive(const Sample& sample) {
    Executor& executor = executors_[executor_of_[sample.subscription]];
    const Arrival arrival =
        executor.scheduler->sample_arrived(number_there(sample.subscription), sample.info, now_);
    if (arrival.overwritten) {
      workload_.overwritten(sample.subscription, arrival.overwritten->sequence);
      if (sink_) {
        JobRecord r;
        r.job = of_whole_set(executor, *arrival.overwritten);
        r.outcome = Outcome::overwritten;
        sink_->ended(r);
      }
    }
    workload_.delivered(sample.subscription, arrived_[sample.subscription]++, sample.info.parent);
    if (executor.events && ++executor.events_waiting > max_backlog_) stop_overloaded();
    wake(executor, arrival.wake);
  }

  void arrive_next() {
    const Sample sample = on_the_way_.front();
    on_the_way_.pop_front();
    arrive(sample);
  }

  /// Only events queues can grow without bound: a wait set holds at most its timers and the
  /// histories of its subscriptions.
  void count_backlog(const SimulatedWorkers::State& worker, std::uint32_t released) {
    Executor& executor = executors_[worker.executor];
    executor.timers_waiting += released;
    if (worker.has_job) {
      const bool timer = set_[worker.job.task].kind == TaskKind::timer;
      std::uint64_t& waiting = timer ? executor.timers_waiting : executor.events_waiting;
      if (waiting > 0) --waiting;  // stock release-and-execute runs timers that were not queued
    }
    if (executor.timers_waiting + executor.events_waiting > max_backlog_) stop_overloaded();
  }

  [[noreturn]] void stop_overloaded() const {
    std::ostringstream message;
    message << std::fixed << std::setprecision(3) << "overload: more than " << max_backlog_
            << " released jobs are waiting to start after " << std::setprecision(1) << to_ms(now_ - Time{})
            << " ms; the utilisation is " << std::setprecision(3)
            << utilisation(set_, summary_.published, now_ - Time{})
            << (platform_.release_cost + platform_.pass_cost + platform_.dispatch_cost > Duration{}
                    ? " without the platform's costs"
                    : "")
            << "; keep it below 1, the capacity of one executor worker, shorten the run or raise the limit";
    throw SimulationError(message.str());
  }

  JobRecord record(Worker w, Outcome outcome) const {
    JobRecord r;
    r.job = workers_[w].job;
    r.start = workers_[w].start;
    r.finish = now_;
    r.outcome = outcome;
    r.worker = static_cast<std::uint16_t>(w);
    return r;
  }

  /// Records everything that was released, published or due before the end and did not run.
  void close() {
    now_ = end_ - Duration(1);
    while (!on_the_way_.empty()) arrive_next();
    if (!sink_) return;
    const auto queued = [&](const Job& job, Outcome outcome) {
      JobRecord r;
      r.job = job;
      r.outcome = outcome;
      sink_->ended(r);
    };
    for (Worker w = 0; w < workers_.size(); ++w) {
      const SimulatedWorkers::State& worker = workers_[w];
      if (worker.step == Step::run) {
        JobRecord r = record(w, Outcome::running);
        r.finish = Time{};
        sink_->ended(r);
      } else if ((worker.step == Step::release || worker.step == Step::dispatch) && worker.has_job &&
                 !worker.job.empty) {
        queued(worker.job, Outcome::queued);  // decided, but not started
      }
    }
    for (const Executor& executor : executors_) {
      executor.scheduler->unfinished(
          now_, [&](const Job& job, Outcome outcome) { queued(of_whole_set(executor, job), outcome); });
    }
  }

  const TaskSet& set_;
  const std::vector<std::uint32_t>& executor_of_;  // by task
  std::vector<TaskId> numbers_;                    // by task: its number in its scheduler; empty: unchanged
  Workload& workload_;
  const Platform platform_;
  const Duration start_;
  const Time end_;
  const std::uint64_t max_backlog_;
  JobSink* const sink_;

  SimulatedWorkers workers_;
  std::deque<Sample> on_the_way_;       // in order of arrival, since all have the same delay
  std::vector<std::uint64_t> arrived_;  // per subscription
  std::vector<Executor> executors_;
  std::vector<Worker> done_;
  Time now_{};
  SimulationSummary summary_;
};

}  // namespace

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
  check_options(options);
  for (const Task& task : set.tasks) check_task(task);
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
