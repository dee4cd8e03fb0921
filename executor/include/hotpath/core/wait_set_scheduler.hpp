// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "hotpath/core/explored_scheduler.hpp"
#include "hotpath/core/number_set.hpp"

namespace hotpath {

/// When rclcpp asks an intra-process subscription whether it has a sample; rcl does not know.
enum class Asked : std::uint8_t {
  at_poll,  ///< As all others (remove_null_handles() in allocator_memory_strategy.hpp).
  at_turn,  ///< When those before it in the snapshot have run (next_ready_waitable() in wait_result.hpp).
};

/// The common part of rclcpp's executors that poll a wait set: the timers and subscriptions of this
/// process in entity order, and the snapshot: the tasks that the last poll found ready and that
/// have not run since, in execution order.
class WaitSet : public ExploredScheduler {
 public:
  void begin(Time epoch) final;
  Effect release_timers(Worker, Time) final { return {}; }
  Joined add_task(const JoiningTask& joining, Time now) final;
  void remove_task(TaskId task, Time now, const Visitor& dropped) final;
  void describe(StateWords& words) const override;
  [[nodiscard]] std::span<const Timer> timers() const final { return timers_; }
  void release_at(TaskId id, Time due) final { timer(id).release_at(due); }
  void released_by(Time now) final {
    for (Timer& timer : timers_) timer.released_by(now);
  }

 protected:
  /// The task has been appended to the entity order. Returns the workers to wake.
  virtual WorkerSet joined(TaskId task) = 0;
  /// The task has been removed from the entity order.
  virtual void left(TaskId /*task*/) {}

  /// What to do with a task of the snapshot when a worker looks for its next job.
  enum class Pick : std::uint8_t {
    run,
    leave,   ///< Continue with the next task; this one stays in the snapshot.
    forget,  ///< Continue with the next task; this one waits for the next poll.
  };

  /// A snapshot is in_order_of_kinds().
  WaitSet(const TaskSet& set, unsigned workers, TaskKind runs_first, const std::vector<TaskId>& entity_order,
          Asked asked);

  /// Appends the ready tasks for which `eligible(TaskId)` is true to the snapshot, and those that are
  /// asked later. Returns the number of tasks in the wait set.
  template <class Eligible>
  std::uint32_t poll(Time now, Eligible&& eligible) {
    for (std::size_t i = 0; i < timers_.size(); ++i)
      if (timers_[i].is_ready(now)) ready_.insert(first_timer_ + i);
    ready_.visit([&](std::size_t place) {
      if (eligible(entities_[place])) snapshot_.add(entities_[place], now);
    });
    return static_cast<std::uint32_t>(entities_.size());
  }

  /// Adds only `task`, if it is ready or asked later.
  void poll_task(TaskId task, Time now) {
    if (is_ready(task, now) || is_asked_at_turn(task)) snapshot_.add(task, now);
  }

  void forget_snapshot() { snapshot_.clear(); }

  /// Decides for the job of the first task in the snapshot for which `pick(TaskId)` returns `run`, if any:
  /// the timer is called or the subscription's oldest sample is taken. A mutually exclusive group is then
  /// busy until free_group().
  template <class Decide>
  void take(Time now, Decision& decision, Decide&& pick) {
    const TaskId id = snapshot_.take_first([&](TaskId task) {
      if (is_asked_at_turn(task) && unread_.count(task) == 0) return Pick::forget;
      const Pick action = pick(task);
      return action == Pick::run && !may_run(task) ? Pick::leave : action;
    });
    if (id == kNoTask) return;
    const Task& task = set_.tasks[id];
    std::optional<Job>& job = decision.job;
    task.kind == TaskKind::timer ? job = timer(id).call(now) : job = unread_.pop(id);
    if ((task.kind == TaskKind::timer || unread_.count(id) == 0) && !is_asked_at_turn(id))
      ready_.erase(place_[id]);
    // If a sample was overwritten since the poll, a younger sample has its place in the snapshot.
    job->release = std::max(snapshot_.added_at(id), job->timestamp);
    group_busy_[task.group] = set_.groups[task.group] == CallbackGroup::mutually_exclusive;
  }

  std::optional<Job> add_unread(TaskId task, const SampleInfo& sample) {
    ready_.insert(place_[task]);  // as pop() in take() erases it
    return unread_.push(task, next_sample(task, sample));
  }

  [[nodiscard]] bool group_free(TaskId task) const { return group_busy_[group(task)] == 0; }
  void free_group(TaskId task) { group_busy_[group(task)] = false; }

  /// When the first of the eligible timers is due.
  template <class Eligible>
  [[nodiscard]] Time next_timer(Eligible&& eligible) const {
    Time next = kNever;
    for (const Timer& timer : timers_) {
      if (timer.due() < next && eligible(timer.task())) next = timer.due();
    }
    return next;
  }

  [[nodiscard]] Timer& timer(TaskId id) { return timers_[timer_number(id)]; }
  [[nodiscard]] bool is_ready(TaskId id, Time now) const {
    return unread_.is_subscription(id) ? unread_.count(id) > 0 : timers_[timer_number(id)].is_ready(now);
  }
  /// All tasks of the wait set, in the order of kinds.
  [[nodiscard]] const std::vector<TaskId>& entities() const { return entities_; }

  std::vector<std::uint8_t> group_busy_;

 private:
  class Snapshot {
   public:
    explicit Snapshot(TaskId tasks) : contains_(tasks, false), added_at_(tasks) {}
    void reserve(std::size_t n) { tasks_.reserve(n); }
    void add_task() {
      contains_.push_back(false);
      added_at_.emplace_back();
    }
    void erase(TaskId task) {
      contains_[task] = false;
      std::erase(tasks_, task);
    }
    void clear() {
      for (const TaskId task : tasks_) contains_[task] = false;
      tasks_.clear();
    }
    void add(TaskId task, Time now) {
      if (contains_[task]) return;
      contains_[task] = true;
      added_at_[task] = now;
      tasks_.push_back(task);
    }
    [[nodiscard]] std::span<const TaskId> tasks() const { return tasks_; }
    /// When the task was last added.
    [[nodiscard]] Time added_at(TaskId task) const { return added_at_[task]; }
    template <class Decide>
    TaskId take_first(Decide&& pick) {
      for (auto at = tasks_.begin(); at != tasks_.end();) {
        const TaskId task = *at;
        const Pick action = pick(task);
        if (action == Pick::leave) {
          ++at;
          continue;
        }
        at = tasks_.erase(at);
        contains_[task] = false;
        if (action == Pick::run) return task;
      }
      return kNoTask;
    }

   private:
    std::vector<TaskId> tasks_;
    std::vector<std::uint8_t> contains_;  // by task
    std::vector<Time> added_at_;          // by task
  };

  [[nodiscard]] std::uint32_t group(TaskId task) const { return set_.tasks[task].group; }
  [[nodiscard]] bool is_asked_at_turn(TaskId task) const {
    return asked_ == Asked::at_turn && set_.tasks[task].entity == EntityKind::intra_process;
  }
  /// After entities_ has changed.
  void number_places();
  [[nodiscard]] std::uint32_t timer_number(TaskId id) const { return place_[id] - first_timer_; }

  const TaskKind runs_first_;
  const Asked asked_;
  std::vector<TaskId> entities_;
  std::vector<std::uint32_t> place_;  // by task: in entities_
  std::vector<Timer> timers_;         // in the order of entities_, where they are beside each other
  std::uint32_t first_timer_ = 0;     // place of the first one
  NumberSet ready_;  // places of subscriptions with samples or asked later, and of timers found ready
  Snapshot snapshot_;
};

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
                   Asked asked = Asked::at_poll, const std::vector<TaskId>& entity_order = {})
      : WaitSet(set, workers, TaskKind::timer, entity_order, asked), blocked_(blocked) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time) override {
    return {is_waited_for(task) ? wait_mutex_.waiting() : WorkerSet{}, add_unread(task, sample)};
  }
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job& job, Time) override {
    free_group(job.task);
    return {wait_mutex_.waiting()};  // as joined(), so that the next wait includes the group again
  }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<WaitSetScheduler>(*this);
  }
  void describe(StateWords& words) const override {
    WaitSet::describe(words);
    if (workers().size() == 1) return;
    if (!threads_alike()) wait_mutex_.describe(words);
    for (const std::uint8_t busy : left_out_) words.add(busy);
  }

 private:
  /// The interrupt guard condition ends the wait, so that the next one includes the task.
  WorkerSet joined(TaskId) override { return wait_mutex_.waiting(); }
  void pick(Time now, Decision& decision) {
    take(now, decision, [this](TaskId id) { return group_free(id) ? Pick::run : Pick::leave; });
  }
  /// A worker of several asks again at the end of the wait, because only then rcl_wait looks what is
  /// ready: samples of other workers arrive meanwhile.
  void begin_wait(Worker worker, Time now, Decision& decision);
  /// Whether the wait set of the sleeping worker has the task.
  [[nodiscard]] bool is_waited_for(TaskId task) const {
    const std::uint32_t group = set_.tasks[task].group;
    return workers().size() == 1 || follows() || (group < left_out_.size() && left_out_[group] == 0);
  }

  const Blocked blocked_;
  std::vector<std::uint8_t> left_out_;  // by callback group: busy when the wait began
  WaitMutex wait_mutex_;
};

/// rclcpp's StaticSingleThreadedExecutor (static_single_threaded_executor.cpp): after each wait it runs
/// the executables that the wait found ready. Subscriptions run first, then timers, then services and
/// clients, each kind in entity order; a timer must still be ready when its turn comes. Callback groups
/// are ignored.
class StaticScheduler final : public WaitSet {
 public:
  enum class Runs : std::uint8_t {
    all,  ///< rclcpp up to 26.
    one,  ///< From 28 on spin() runs one executable per wait (spin_once_impl()).
  };

  StaticScheduler(const TaskSet& set, Runs runs, Asked asked, const std::vector<TaskId>& entity_order)
      : WaitSet(set, 1, TaskKind::subscription, entity_order, asked), runs_(runs) {}

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time) override {
    return {WorkerSet::of(0), add_unread(task, sample)};
  }
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker, const Job&, Time) override { return {}; }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<StaticScheduler>(*this);
  }

 private:
  WorkerSet joined(TaskId) override { return WorkerSet::of(0); }
  void next_ready(Time now, Decision& decision) {
    take(now, decision, [this, now](TaskId id) {
      // rclcpp checks a timer again, although no other thread calls it.
      return is_ready(id, now) ? Pick::run : Pick::leave;
    });
  }

  const Runs runs_;
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
  RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers, Asked asked = Asked::at_turn,
                          const std::vector<TaskId>& entity_order = {});

  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time) override {
    return {is_waited_for_[task] ? wait_mutex_.waiting() : WorkerSet{}, add_unread(task, sample)};
  }
  Decision decide(Worker worker, Time now) override;
  Effect finished(Worker worker, const Job& job, Time now) override;
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<RebuiltWaitSetScheduler>(*this);
  }
  void describe(StateWords& words) const override;

 private:
  WorkerSet joined(TaskId) override {
    is_waited_for_.push_back(false);
    interrupted_ = true;  // the wait set is rebuilt before the next wait
    return wait_mutex_.waiting();
  }
  void left(TaskId task) override {
    is_waited_for_[task] = false;
    std::erase(waited_, task);
  }
  void pick(Time now, Decision& decision) {
    take(now, decision, [this](TaskId id) {
      if (group_free(id)) return Pick::run;
      return set_.tasks[id].kind == TaskKind::timer ? Pick::leave : Pick::forget;
    });
  }
  void wait(Time now, Decision& decision);
  void rebuild();

  std::vector<TaskId> waited_;       // in the order of the wait set
  std::vector<bool> is_waited_for_;  // by task
  bool interrupted_ = false;         // whether the guard condition is triggered
  bool needs_rebuild_ = false;
  WaitMutex wait_mutex_;
};

}  // namespace hotpath
