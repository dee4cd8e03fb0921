// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/wait_set.hpp"

namespace hotpath {

/// The mutex under which the workers of rclcpp's MultiThreadedExecutor look for work and wait for
/// it (multi_threaded_executor.cpp): one idle worker sleeps in rcl_wait and keeps the mutex, the
/// others queue for it, also those that have just ended a job.
class WaitMutex {
 public:
  /// `worker` looks for work. Returns whether another worker keeps the mutex; then this one queues.
  bool blocks(Worker worker) {
    if (!waiting_ || waiting_ == worker) return false;
    idle_.insert(worker);
    return true;
  }

  /// `worker` looks for work. Returns whether this worker slept in rcl_wait.
  bool enter(Worker worker) {
    idle_.erase(worker);
    if (waiting_ != worker) return false;
    waiting_.reset();
    return true;
  }

  /// The worker that gets the mutex after a worker has found a job: it runs the rest of the
  /// snapshot or waits in its place.
  [[nodiscard]] WorkerSet next() const {
    return waiting_ || idle_.empty() ? WorkerSet{} : WorkerSet::of(idle_.first());
  }

  /// `worker` found no job. Returns whether it sleeps in rcl_wait, which it does unless another
  /// worker does.
  bool wait(Worker worker) {
    idle_.insert(worker);
    if (waiting_) return false;
    waiting_ = worker;
    return true;
  }

  void describe(StateWords& words) const {
    words.add(static_cast<std::int64_t>(idle_.bits()));
    words.add(static_cast<std::int64_t>(waiting().bits()));
  }

  /// The worker in rcl_wait, if there is one.
  [[nodiscard]] WorkerSet waiting() const { return waiting_ ? WorkerSet::of(*waiting_) : WorkerSet{}; }

 private:
  WorkerSet idle_;
  std::optional<Worker> waiting_;
};

/// How a poll treats tasks of the snapshot whose callback groups are busy.
enum class Blocked : std::uint8_t {
  forgotten,  ///< rclcpp up to 26 (Humble, Iron).
  kept,  ///< Kept ahead of newly found tasks: the remedy of Teper et al. (Thread Carefully, EMSOFT 2024).
};

/// rclcpp's SingleThreadedExecutor (one worker), and MultiThreadedExecutor (several) up to rclcpp
/// 26 (executor.cpp, allocator_memory_strategy.hpp). At a polling point every ready timer and
/// subscription enters the snapshot once; all workers share it. The processing window picks timers
/// before subscriptions, each in entity order, and `call()` happens at the pick. Tasks that become
/// ready meanwhile wait for the next poll. Polls and picks leave out a mutually exclusive callback
/// group with a running job.
class WaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]; with one worker no group is ever busy when it looks for work.
  WaitSetScheduler(const TaskSet& set, unsigned workers, Blocked blocked = Blocked::forgotten,
                   const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, workers, TaskKind::timer, entity_order), blocked_(blocked) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<WaitSetScheduler>(*this);
  }
  void describe(StateWords& words) const override {
    WaitSet::describe(words);
    if (workers().size() == 1) return;
    wait_mutex_.describe(words);
    for (const bool busy : left_out_) words.add(busy ? 1 : 0);
  }

 private:
  /// The interrupt guard condition ends the wait, so that the next one includes the task.
  WorkerSet joined(TaskId) override { return wait_mutex_.waiting(); }
  std::optional<Job> pick(Time now);
  /// A worker of several asks again at the end of the wait, because only then rcl_wait looks what is
  /// ready: samples of other workers arrive meanwhile.
  Decision begin_wait(Worker worker, Time now);
  /// Whether the wait set of the sleeping worker has the task.
  [[nodiscard]] bool is_waited_for(TaskId task) const {
    const std::uint32_t group = set_.tasks[task].group;
    return workers().size() == 1 || follows() || (group < left_out_.size() && !left_out_[group]);
  }

  const Blocked blocked_;
  std::vector<bool> left_out_;  // by callback group: busy when the wait began
  WaitMutex wait_mutex_;
};

/// rclcpp 26.0.0 StaticSingleThreadedExecutor (static_single_threaded_executor.cpp): after each
/// wait it runs all executables that the wait found ready. Subscriptions run first, then timers,
/// then services and clients, each kind in entity order; a timer must still be ready when its turn
/// comes. Callback groups are ignored.
class StaticScheduler final : public WaitSet {
 public:
  explicit StaticScheduler(const TaskSet& set, const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, 1, TaskKind::subscription, entity_order) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job&, Time) override { return {}; }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<StaticScheduler>(*this);
  }

 private:
  WorkerSet joined(TaskId) override { return WorkerSet::of(0); }
  std::optional<Job> next_ready(Time now);

  bool sleeps_ = false;  // whether the worker sleeps in rcl_wait
};

/// rclcpp's MultiThreadedExecutor from 28 on (Jazzy; executor.cpp, wait_result.hpp,
/// executor_entities_collection.cpp, multi_threaded_executor.cpp). The wait set outlives the wait.
/// When a job of a mutually exclusive group ends, it triggers a guard condition, which ends the
/// wait and makes the executor rebuild the wait set before the next wait. The rebuild removes
/// groups that are busy then and appends groups that have become free, so the order in the wait set
/// keeps changing. That prevents the starvation that occurs under rclcpp 26.
///
/// Between two rebuilds the wait set contains tasks whose group is busy. A blocked timer stays in
/// the snapshot; a blocked subscription leaves it until the next poll. An rclcpp worker that finds
/// only blocked tasks polls again and again until something changes; here it sleeps until then.
class RebuiltWaitSetScheduler final : public WaitSet {
 public:
  /// `workers` in [1, kMaxWorkers]. Tasks that are appended to the wait set together appear in
  /// reverse order of creation: rclcpp takes them from hash maps that iterate from the last
  /// insertion.
  RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers, const std::vector<TaskId>& entity_order = {});

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override;
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<RebuiltWaitSetScheduler>(*this);
  }
  void describe(StateWords& words) const override;

 private:
  WorkerSet joined(TaskId task) override;
  void left(TaskId task) override;
  std::optional<Job> pick(Time now);
  std::optional<Job> wait(Time now);
  void rebuild();
  void rebuild(std::vector<TaskId>& waited, const std::vector<TaskId>& all);

  std::vector<TaskId> waited_timers_, waited_subscriptions_;  // in the order of the wait set
  std::vector<bool> is_waited_for_;                           // by task
  bool interrupted_ = false;                                  // whether the guard condition is triggered
  bool needs_rebuild_ = false;
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
