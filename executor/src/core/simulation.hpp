// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <deque>
#include <span>
#include <string>

#include "hotpath/core/simulator.hpp"
#include "simulated_workers.hpp"

namespace hotpath {

/// No instant or duration of a simulation exceeds this, so that a sum of a few cannot overflow 63 bits.
inline constexpr Duration kLongestInstant{std::int64_t{1} << 60};  // 36 years

/// Throws SimulationError for what cannot be simulated.
void check_simulation(const TaskSet& set, const SimulationOptions& options);

/// A simulation of one schedule, instant by instant. All inline: it is the simulator's inner loop.
class Simulation {
 public:
  Simulation(const TaskSet& set, std::span<const SimulatedExecutor> executors,
             const std::vector<std::uint32_t>& executor_of, Workload& workload,
             const SimulationOptions& options, JobSink* sink)
      : set_(set),
        executor_of_(executor_of),
        start_(options.start),
        end_(Time{} + options.duration),
        overload_backlog_(std::min(options.overload_backlog, options.max_backlog)),
        max_backlog_(options.max_backlog),
        sink_(sink),
        deliveries_(options.deliveries),
        workload_(&workload),
        platform_(options.platform),
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
    begin_schedulers();
    begin_workers();
    for (Time next = next_instant(); next < end_; next = next_instant()) advance(next);
    close();
    return std::move(summary_);
  }

  /// The parts of run(): everything until the first instant at which something ends or falls due, and what
  /// happens at such an instant.
  void begin_schedulers() {
    for (const Executor& executor : executors_) executor.scheduler->begin(Time{});
    now_ = Time{} + start_;
  }
  void begin_workers() {
    for (Worker w = 0; w < workers_.size(); ++w) workers_.make_ready(w, now_);
    take_steps();
  }
  [[nodiscard]] Time next_instant() const {
    const Time next = workers_.next_instant(now_);
    return on_the_way_.empty() ? next : std::min(next, on_the_way_.front().arrival);
  }
  void advance(Time instant) {
    now_ = instant;
    finish_jobs();
    while (!on_the_way_.empty() && on_the_way_.front().arrival <= now_) arrive_next();
    workers_.wake_sleepers(now_);
    take_steps();
  }

 protected:
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
    std::uint64_t number;  ///< Among those of the subscription, in the order of publication.
    SampleInfo info;

    /// Whether they have one publisher, which published this one earlier.
    [[nodiscard]] bool goes_before(const Sample& other) const {
      return subscription == other.subscription && info.parent.task == other.info.parent.task &&
             number < other.number;
    }
  };

 private:
  /// Jobs that end now finish before anything else happens at this instant, even if a woken worker
  /// of higher priority takes their core.
  void finish_jobs() {
    done_.clear();
    for (const Worker w : workers_.on_cores()) {
      SimulatedWorkers::State& worker = workers_[w];
      if (worker.step == Step::run && worker.until <= now_ && worker.ends_in_next_round()) done_.push_back(w);
    }
    if (done_.size() > 1) std::sort(done_.begin(), done_.end());
    for (const Worker w : done_) finish_job(w);
  }

  Executor& executor_of(Worker w) { return executors_[workers_[w].executor]; }

  /// Translates a scheduler's job to the task's number in the whole set.
  static void to_whole_set(const Executor& executor, Job& job) {
    if (!executor.tasks.empty()) job.task = executor.tasks[job.task];
  }
  /// Passes on the record of a scheduler's job that never runs.
  void end_unstarted(const Executor& executor, Job job, Outcome outcome) {
    to_whole_set(executor, job);
    if (sink_) sink_->ended({.job = job, .outcome = outcome});
  }
  /// The task's number in the scheduler that serves it.
  TaskId number_there(TaskId task) const { return numbers_.empty() ? task : numbers_[task]; }

  void wake(Worker first, WorkerSet numbers) {
    while (!numbers.empty()) workers_.wake(first + numbers.pop_first(), now_);
  }

  /// Runs all steps of this instant, in rounds: after the release of one timer, the woken worker
  /// decides before the next timer is released, if that worker has a core.
  void take_steps() {
    workers_.rotate_expired(now_);
    for (bool stepped = true; stepped;) {
      stepped = false;
      for (std::size_t i = 0; i < workers_.on_cores().size(); ++i) {
        const Worker w = workers_.on_cores()[i];
        if (workers_[w].until > now_ || workers_[w].rounds > 0) continue;
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
    if (worker.has_job) to_whole_set(executor, worker.record.job = *turn.decision.job);
    worker.wake_at = turn.decision.wake_at;
    worker.queues = turn.decision.blocked;
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
    if (turn.decision.waited_for > 0) {
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
    wake(executor_of(w).first, worker.to_wake);
    if (worker.has_job) {
      worker.in_pass = false;
      const Duration cost = platform_.dispatch_cost(set_[worker.record.job.task].kind);
      workers_.begin_step(w, Step::dispatch, cost, now_);
      if (worker.on_core && cost == Duration{}) start_job(w);
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
    const Job& job = worker.record.job;
    worker.record.start = now_;
    if (job.empty) {
      end(w, Outcome::empty);
      return done(w);
    }
    run(w, workload_->start(job, now_));
    if (workers_.size() > 1) worker.rounds = workload_->end_round(job);  // alone, it ends beside no other
    if (sink_) sink_->started(worker.record);
  }

  void run(Worker w, Duration time) {
    if (time < Duration{} || time > kLongestInstant) {
      throw SimulationError("the execution time of a job of task `" + set_[workers_[w].record.job.task].name +
                            "` must be between 0 and 2^60 ns");
    }
    workers_.begin_step(w, Step::run, time, now_);
  }

  /// Ends a job, or a part of it at whose end it publishes.
  void finish_job(Worker w) {
    const Job& job = workers_[w].record.job;
    const std::span<const TaskId> reached = workload_->finish(job, set_[job.task], now_);
    const std::optional<Duration> rest = workload_->rest();
    if (!rest) {
      ++summary_.jobs;
      end(w, Outcome::ran);
    }
    if (!reached.empty()) publish(job, reached);
    rest ? run(w, *rest) : done(w);
  }

  void done(Worker w) {
    again(w);
    const Executor& executor = executor_of(w);
    Job& job = workers_[w].record.job;
    job.task = number_there(job.task);
    wake(executor.first, executor.scheduler->finished(workers_[w].number, job, now_).wake);
  }

  void publish(const Job& job, std::span<const TaskId> reached) {
    const SampleInfo info{now_, job.deadline, job.ref()};
    for (const TaskId subscription : reached) {
      const Sample sample{now_ + platform_.delivery_delay, subscription, summary_.published[subscription]++,
                          info};
      sample.arrival > now_ ? send(sample) : arrive(sample);
    }
  }

  void send(Sample sample) {
    if (deliveries_) {
      sample.arrival = now_ + deliveries_->of(sample.subscription, sample.number, platform_.delivery_delay);
      for (const Sample& earlier : on_the_way_) {
        if (earlier.goes_before(sample)) sample.arrival = std::max(sample.arrival, earlier.arrival);
      }
    }
    if (sample.arrival <= now_) return arrive(sample);
    const auto sooner = [](const Sample& a, const Sample& b) { return a.arrival < b.arrival; };
    on_the_way_.insert(std::upper_bound(on_the_way_.begin(), on_the_way_.end(), sample, sooner), sample);
  }

  void arrive(const Sample& sample) {
    Executor& executor = executors_[executor_of_[sample.subscription]];
    const Arrival arrival =
        executor.scheduler->sample_arrived(number_there(sample.subscription), sample.info, now_);
    if (arrival.overwritten) {
      workload_->overwritten(sample.subscription, arrival.overwritten->sequence);
      end_unstarted(executor, *arrival.overwritten, Outcome::overwritten);
    }
    workload_->delivered(sample.subscription, arrived_[sample.subscription]++, sample.info.parent);
    if (executor.events && ++executor.events_waiting > overload_backlog_) check_load(executor.events_waiting);
    wake(executor.first, arrival.wake);
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
      const bool timer = set_[worker.record.job.task].kind == TaskKind::timer;
      std::uint64_t& waiting = timer ? executor.timers_waiting : executor.events_waiting;
      if (waiting > 0) --waiting;  // stock release-and-execute runs timers that were not queued
    }
    const std::uint64_t waiting = executor.timers_waiting + executor.events_waiting;
    if (waiting > overload_backlog_) check_load(waiting);
  }

  /// Throws SimulationError if so many waiting jobs mean overload. Below full load a long queue is a burst,
  /// or a job that waits for a long one.
  void check_load(std::uint64_t waiting) const;

  /// Completes the record of a job that has started, and passes it on.
  void end(Worker w, Outcome outcome) {
    JobRecord& record = workers_[w].record;
    record.finish = outcome == Outcome::running ? Time{} : now_;
    record.outcome = outcome;
    if (sink_) sink_->ended(record);
  }

  /// Records everything that was released, published or due before the end and did not run.
  void close();

  const TaskSet& set_;
  const std::vector<std::uint32_t>& executor_of_;  // by task
  std::vector<TaskId> numbers_;                    // by task: its number in its scheduler; empty: unchanged
  const Duration start_;
  const Time end_;
  const std::uint64_t overload_backlog_, max_backlog_;
  JobSink* const sink_;
  const Deliveries* const deliveries_;
  std::vector<std::uint64_t> arrived_;  // per subscription
  std::vector<Worker> done_;
  SimulationSummary summary_;

 protected:
  Workload* workload_;
  const Platform platform_;
  SimulatedWorkers workers_;
  std::vector<Executor> executors_;
  std::deque<Sample> on_the_way_;  // in order of arrival
  Time now_{};
};

}  // namespace hotpath
