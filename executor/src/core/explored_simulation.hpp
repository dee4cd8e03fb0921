// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "hotpath/core/exploration.hpp"
#include "hotpath/core/explored_scheduler.hpp"
#include "simulation.hpp"

namespace hotpath {

/// A simulation of one executor, with its scheduler and its workload, that can be stopped between two
/// instants, copied there, and continued with other instants of what ends next.
class ExploredSimulation : public Simulation {
 public:
  /// `executor` has `scheduler` as its scheduler.
  ExploredSimulation(const TaskSet& set, const SimulatedExecutor& executor,
                     const std::vector<std::uint32_t>& executor_of,
                     std::unique_ptr<ExploredScheduler> scheduler, std::unique_ptr<Workload> workload,
                     const SimulationOptions& options, JobSink* sink)
      : Simulation(set, std::span(&executor, 1), executor_of, *workload, options, sink),
        scheduler_(std::move(scheduler)),
        own_workload_(std::move(workload)) {}
  ExploredSimulation(const ExploredSimulation& other)
      : Simulation(other), scheduler_(other.scheduler_), own_workload_(other.own_workload_) {
    executors_.front().scheduler = scheduler_.get();
    workload_ = own_workload_.get();
  }
  [[nodiscard]] std::unique_ptr<ExploredSimulation> clone() const {
    return std::make_unique<ExploredSimulation>(*this);
  }

  [[nodiscard]] ExploredScheduler& scheduler() const { return *scheduler_; }
  [[nodiscard]] const Workload& workload() const { return *own_workload_; }
  [[nodiscard]] SimulatedWorkers& workers() { return workers_; }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] static bool waits(const SimulatedWorkers::State& worker) {
    return worker.step == Step::asleep || worker.step == Step::blocked;
  }
  /// Whether its two threads have one core in turns.
  [[nodiscard]] bool shares_core() const {
    return workers_.size() > 1 && platform_.cores == 1 && !platform_.raised_releaser;
  }
  /// Whether several threads run jobs. Each then has a core, and nothing but the jobs takes time.
  [[nodiscard]] bool several() const {
    return workers_.size() > 1 && scheduler_->workers()[1] == WorkerRole::executor;
  }

  /// Everything until the first instant at which something ends or falls due. `released`: held timers
  /// (Timer::is_held()) that are ready then.
  void begin(std::span<const TaskId> released) {
    begin_schedulers();
    for (const TaskId timer : released) scheduler_->release_at(timer, now_);
    begin_workers();
  }

  /// A held timer becomes ready at this instant, to which advance() goes next.
  void release(TaskId timer, Time instant) {
    scheduler_->release_at(timer, instant);
    const Worker w = workers_.size() - 1;  // the timer thread if there is one
    SimulatedWorkers::State& worker = workers_[w];
    const Time awake = instant + platform_.wake_up_latency;
    if (worker.step == Step::asleep && awake < worker.until) workers_.sleep_until(w, awake);
    if (worker.step != Step::asleep && !worker.has_job) worker.wake_at = std::min(worker.wake_at, instant);
  }

  /// Whatever workers found due was so by `now`, which may precede now().
  void due_by(Time now) {
    for (Worker w = 0; w < workers_.size(); ++w) {
      if (workers_[w].wake_at <= now_) workers_[w].wake_at = std::min(workers_[w].wake_at, now);
    }
  }

  using Simulation::Sample;
  /// In the order in which they were published.
  [[nodiscard]] const std::deque<Sample>& on_the_way() const { return on_the_way_; }
  /// Changes which samples on the way arrive at the next instant.
  template <class ArrivalOf>
  void reschedule_arrivals(const ArrivalOf& arrival_of) {
    for (Sample& sample : on_the_way_) sample.arrival = arrival_of(sample);
    std::ranges::stable_sort(on_the_way_, {}, &Sample::arrival);
  }

  /// Adds what decides its future besides its scheduler and its workload, and besides the end of the step
  /// and of the time slice of worker 0, and when samples arrive. Nor when worker 0 wakes (`wakes`), nor when
  /// worker 1 wakes or its release ends (`releases`).
  void describe(StateWords& words, bool wakes, bool releases) const {
    if (several()) return describe_threads(words);
    words.add((wakes ? 1 : 0) + (releases ? 2 : 0));
    for (Worker w = 0; w < workers_.size(); ++w) {
      describe_thread(w, w == 0 ? wakes : releases, releases, words);
      describe_next(workers_[w], words);
    }
    for (const Sample& sample : on_the_way_) {
      words.add(sample.subscription);
      describe_publication(sample.info.parent, words);
      if (scheduler_->hands_deadlines_down()) words.add(sample.info.deadline);
    }
    const std::optional<Worker> holder = executors_.front().lock_holder;
    words.add(holder ? static_cast<std::int64_t>(*holder) : -1);
  }

 private:
  /// Of several: what they run, in the order in which they act at one instant; and until when the others
  /// sleep, of which all but one wait to be woken.
  void describe_threads(StateWords& words) const {
    words.add(static_cast<std::int64_t>(workers_.on_cores().size()));
    for (const Worker w : workers_.on_cores()) {
      if (!scheduler_->threads_alike()) words.add(w);
      describe_next(workers_[w], words);
    }
    words.add(workers_.next_to_wake());
  }

  void describe_thread(Worker w, bool wakes, bool releases, StateWords& words) const {
    const SimulatedWorkers::State& worker = workers_[w];
    words.add(static_cast<std::int64_t>(worker.step));
    words.add((worker.on_core ? 1 : 0) + (worker.woken ? 2 : 0) + (worker.in_pass ? 4 : 0));
    words.add(worker.priority);
    if (worker.step == Step::asleep && !wakes) words.add(worker.until);
    if (waits(worker)) return;
    if (w > 0 && worker.on_core && releases) words.add((worker.slice_end - worker.until).count());
    if (w > 0 && worker.on_core && !releases) words.add(worker.until);
    if (w > 0 && !worker.on_core) words.add(worker.remaining.count());
    if (w == 0 && !worker.on_core) words.add(worker.remaining == Duration{} ? 1 : 0);
    if (!worker.on_core) words.add(worker.slice_left.count());
  }

  /// What the worker does after its step.
  void describe_next(const SimulatedWorkers::State& worker, StateWords& words) const {
    if (waits(worker)) return;
    if (!worker.has_job) {
      worker.wake_at <= now_ ? words.add(-2) : words.add(worker.wake_at);
      return;
    }
    words.add(worker.record.job.task);
    words.add(worker.record.job.empty ? 1 : 0);
    if (is_of_timer(worker.record.job)) words.add(worker.record.job.timestamp);
    if (scheduler_->hands_deadlines_down()) words.add(worker.record.job.deadline);
    if (worker.step == Step::run) own_workload_->describe(worker.record.job, words);
  }

  const Cloned<ExploredScheduler> scheduler_;
  const Cloned<Workload> own_workload_;
};

}  // namespace hotpath
