// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hotpath/core/sample_rings.hpp"
#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/state_words.hpp"
#include "hotpath/core/timer.hpp"

namespace hotpath {

/// A pointer to an object of its own. A copy points to a clone() of that object.
template <class T>
struct Cloned : std::unique_ptr<T> {
  // NOLINTNEXTLINE(google-explicit-constructor)
  Cloned(std::unique_ptr<T> own) : std::unique_ptr<T>(std::move(own)) {}
  Cloned(const Cloned& other) : std::unique_ptr<T>(other->clone()) {}
  Cloned(Cloned&&) noexcept = default;
  Cloned& operator=(Cloned&&) noexcept = default;
};

/// The common part of all schedulers: their tasks, unread samples and workers. It shows the state on which
/// decisions depend, for the exploration of all schedules (explore()); no driver of a single schedule needs
/// that.
class ExploredScheduler : public Scheduler {
 public:
  [[nodiscard]] std::span<const WorkerRole> workers() const final { return roles_; }
  [[nodiscard]] std::uint32_t unread(TaskId task) const final { return unread_.count(task); }
  void unfinished(Time now, const Visitor& visit) const override {
    for (const Timer& timer : timers()) visit_due(timer, now, visit);
    for (TaskId id = 0; id < unread_.tasks(); ++id)
      for (std::uint32_t i = 0; i < unread_.count(id); ++i) visit(unread_.peek(id, i), Outcome::queued);
  }

  /// A copy in the same state; none: it is not explored.
  [[nodiscard]] virtual std::unique_ptr<ExploredScheduler> clone() const { return nullptr; }
  /// Adds all that its later answers depend on, besides the numbers of the tasks and the calls to come.
  virtual void describe(StateWords& words) const = 0;
  /// The first instant after `now` at which an answer can change though nothing was called between: the next
  /// timestamp of a timer.
  [[nodiscard]] virtual Time next_change(Time now) const {
    Time next = kNever;
    for (const Timer& timer : timers()) next = std::min(next, timer.next_timestamp(now));
    return next;
  }
  [[nodiscard]] virtual std::span<const Timer> timers() const = 0;
  /// A timer that Timer::is_held() becomes ready at `due`, which is now.
  virtual void release_at(TaskId timer, Time due) = 0;
  /// Every timer that release_at() made ready was so by `now`, in the same order: for another of the
  /// schedules that one state stands for, in which it is earlier.
  virtual void released_by(Time now) = 0;
  /// Whether threads that run jobs are alike but for what their numbers call them.
  [[nodiscard]] bool threads_alike() const { return threads_alike_; }
  /// Whether a job's deadline decides when the jobs run that it activates.
  [[nodiscard]] virtual bool hands_deadlines_down() const { return false; }

 protected:
  /// `executors` executor workers, at least one, and the timer management worker if it `has_releaser`: at
  /// most kMaxWorkers.
  ExploredScheduler(const TaskSet& set, unsigned executors, bool has_releaser)
      : own_set_(std::make_shared<TaskSet>(set)),
        set_(*own_set_),
        unread_(set),
        arrived_(set.size(), 0),
        roles_(executors, WorkerRole::executor) {
    if (has_releaser) roles_.push_back(WorkerRole::timer_management);
    assert(executors >= 1 && roles_.size() <= kMaxWorkers);
  }

  TaskId join_set(const JoiningTask& joining) {
    const TaskId id = join(changed_set(), joining);
    unread_.add_task(set_[id]);
    arrived_.push_back(0);
    return id;
  }
  /// Not of a clone, nor after it was cloned.
  TaskSet& changed_set() {
    assert(own_set_.use_count() == 1 && "clones share their tasks");
    return *own_set_;
  }
  /// The job of a sample that arrives.
  Job next_sample(TaskId task, const SampleInfo& sample) {
    return {.task = task,
            .sequence = arrived_[task]++,
            .timestamp = sample.published,
            .deadline = sample.deadline,
            .parent = sample.parent};
  }
  void drop_unread(TaskId task, const Visitor& dropped) {
    while (unread_.count(task) > 0) dropped(unread_.pop(task), Outcome::queued);
  }
  static void visit_due(const Timer& timer, Time now, const Visitor& visit) {
    if (timer.next_call() > now) return;
    Timer at_the_end = timer;
    visit(at_the_end.call(now), Outcome::queued);
  }

  const std::shared_ptr<TaskSet> own_set_;  // shared with clones
  const TaskSet& set_;
  bool threads_alike_ = false;
  SampleRings<Job> unread_;  // of every subscription, as jobs that have no release yet

 private:
  std::vector<std::uint64_t> arrived_;  // by task
  std::vector<WorkerRole> roles_;
};

}  // namespace hotpath
