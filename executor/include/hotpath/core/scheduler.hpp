// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// The consequences of a scheduler call for the driver.
struct Effect {
  WorkerSet wake;              ///< Workers that must ask for a decision again.
  std::uint32_t released = 0;  ///< Timers released by this call; each costs delta (paper, Section V-B).
};

/// Answer to an arriving sample.
struct Arrival {
  WorkerSet wake;
  std::optional<Job> overwritten;  ///< The unread sample that the new one replaced in the reader's history.
};

/// Answer to a joining task.
struct Joined {
  TaskId task = kNoTask;
  WorkerSet wake;
};

/// One scheduling decision.
struct Decision {
  std::optional<Job> job;  ///< The job that this worker runs next.
  Time wake_at = kNever;   ///< Without a job: sleep until this instant or until woken.
  WorkerSet wake;          ///< Other workers that must ask for a decision.
  /// Number of tasks in the wait set that this decision built and scanned; 0 if the job came from a
  /// snapshot, a queue, or the wait in which the worker slept. Without a job: a wait of workers that
  /// share a wait set begins, at whose end, after its cost, the worker asks again or sleeps.
  std::uint32_t waited_for = 0;
  bool blocked = false;  ///< Without a job: the worker queues for a mutex that a sleeping one keeps.
};

/// Decides which job runs next and owns the queues. A plain state machine without thread, clock or
/// lock: the driver (live executor or simulator) serialises the calls and passes `now`, which never
/// decreases. After begin() no call allocates, except when a queue exceeds its largest size so far
/// and when tasks join or leave.
class Scheduler {
 public:
  virtual ~Scheduler() = default;

  /// The workers this scheduler needs, with their roles; constant over its life.
  [[nodiscard]] virtual std::span<const WorkerRole> workers() const = 0;

  /// Sets every timer's first timestamp to `epoch` plus its phase. Called once, before any other call.
  virtual void begin(Time epoch) = 0;

  /// Releases due timers into a queue: the stock events executor one timer per call, the paper's
  /// all due timers. Has no effect for wait sets, for stock release-and-execute, and for any worker
  /// other than the releaser.
  virtual Effect release_timers(Worker worker, Time now) = 0;

  /// A sample became available to the subscription `task`.
  virtual Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) = 0;

  /// Decides the next step of `worker`. A subscription's job takes the oldest unread sample.
  virtual Decision decide(Worker worker, Time now) = 0;

  /// `worker` is done with `job`.
  virtual Effect finished(Worker worker, const Job& job, Time now) = 0;

  /// Unread samples of a subscription (level-triggered readiness; drivers check their own count against it).
  [[nodiscard]] virtual std::uint32_t unread(TaskId task) const = 0;

  /// Visits what was due or unread, but not started, at the end `now` of a run: `queued` jobs, and
  /// the timestamps that a call at `now` would skip.
  using Visitor = std::function<void(const Job&, Outcome)>;
  virtual void unfinished(Time now, const Visitor& visit) const = 0;

  /// Adds a task after begin(). Its id is the number of tasks so far, including removed ones. A
  /// timer's first timestamp is `now` plus its phase. A timer that is not local is never released,
  /// but passes its priority on (events schedulers only).
  virtual Joined add_task(const JoiningTask& joining, Time now) = 0;

  /// Removes a task: none of its jobs starts any more, and no sample may arrive for it; a running
  /// job still ends with finished(). Visits jobs that were released, due or unread, as unfinished()
  /// does. Takes time proportional to the number of tasks and of queued jobs.
  virtual void remove_task(TaskId task, Time now, const Visitor& dropped) = 0;

  /// Changes the given priority of a task and the tasks that it feeds: jobs released from now on
  /// are ordered accordingly. Has no effect if the scheduler's order does not depend on them.
  virtual void change_task(TaskId /*task*/, const std::optional<std::int64_t>& /*priority*/,
                           const std::vector<TaskId>& /*feeds*/) {}

  /// Makes decisions follow a recorded schedule: from now on a decision takes the first job, in the
  /// scheduler's own order, for whose task `may_run` is true, and none if there is no such job.
  /// `may_run` sees each task that it rejects, so the first one it sees is the one that the
  /// scheduler would have run. Such decisions may allocate.
  using Choice = std::function<bool(TaskId)>;
  void follow(Choice may_run) { may_run_ = std::move(may_run); }

 protected:
  /// Whether decisions follow a recorded schedule; otherwise every job may run.
  [[nodiscard]] bool follows() const { return may_run_ != nullptr; }
  [[nodiscard]] bool may_run(TaskId task) const { return !follows() || may_run_(task); }

 private:
  Choice may_run_;
};

/// One turn of a worker: release, then decide. Every driver advances a worker only through
/// take_turn().
struct Turn {
  Decision decision;
  std::uint32_t released = 0;
};
/// Calls release_timers() and decide(); the result's `wake` includes both but not `worker` itself.
inline Turn take_turn(Scheduler& scheduler, Worker worker, Time now) {
  const Effect effect = scheduler.release_timers(worker, now);
  Turn turn{scheduler.decide(worker, now), effect.released};
  turn.decision.wake |= effect.wake;
  turn.decision.wake.erase(worker);
  return turn;
}

}  // namespace hotpath
