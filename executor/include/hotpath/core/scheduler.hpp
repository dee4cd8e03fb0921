// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/core/state_words.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

class Timer;
class UnreadSamples;

/// What a call to a scheduler causes outside of it.
struct Effect {
  WorkerSet wake;              ///< Workers that must ask for a decision again.
  std::uint32_t released = 0;  ///< Timers released by this call; each costs delta (paper, Section V-B).
};

/// Answer to an arriving sample.
struct Arrival {
  WorkerSet wake;
  std::optional<Job> overwritten;  ///< The unread sample that this one replaced in the reader's history.
};

/// Answer to a joining task.
struct Joined {
  TaskId task = kNoTask;
  WorkerSet wake;
};

/// One scheduling decision.
struct Decision {
  std::optional<Job> job;  ///< The job that this worker runs next.
  Time wake_at = kNever;   ///< No job: sleep until then or until woken.
  WorkerSet wake;          ///< Other workers that must ask for a decision.
  /// Tasks in the wait set that this decision built and scanned; 0: it came from a snapshot or a queue, or
  /// from the wait in which the worker slept.
  std::uint32_t waited_for = 0;
};

/// Decides which job runs next and owns the queues. A plain state machine: no thread, no clock, no lock; the
/// driver (live executor or simulator) serialises the calls and passes `now`, which never decreases.
/// No call allocates once begin() has returned, except where a queue outgrows its largest size so far, and
/// where tasks come and go.
class Scheduler {
 public:
  virtual ~Scheduler() = default;

  /// The workers this scheduler needs, with their roles; constant over its life.
  [[nodiscard]] virtual std::span<const WorkerRole> workers() const = 0;

  /// Sets every timer's first timestamp to `epoch` plus its phase. Called once, before any other call.
  virtual void begin(Time epoch) = 0;

  /// Releases due timers into a queue. Nothing to do for wait sets and for stock release-and-execute, and for
  /// any worker that is not the releaser. The stock events executor releases one timer per call, the paper's
  /// all that are due.
  virtual Effect release_timers(Worker worker, Time now) = 0;

  /// A sample became available to the subscription `task`.
  virtual Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) = 0;

  /// What `worker` does next. A subscription's job takes the oldest unread sample.
  virtual Decision decide(Worker worker, Time now) = 0;

  /// `worker` is done with `job`.
  virtual Effect finished(Worker worker, const Job& job, Time now) = 0;

  /// Unread samples of a subscription (level-triggered readiness; drivers check their own count against it).
  [[nodiscard]] virtual std::uint32_t unread(TaskId task) const = 0;

  /// Visits what was due or unread at the end `now` of a run and not started: `queued` jobs, and the
  /// timestamps that a call at `now` would skip.
  using Visitor = std::function<void(const Job&, Outcome)>;
  virtual void unfinished(Time now, const Visitor& visit) const = 0;

  /// A task joins the schedule, after begin(). Its id is the number of tasks so far, removed ones included. A
  /// timer's first timestamp is `now` plus its phase; one that is not local is never released, but hands its
  /// priority down (events schedulers only).
  virtual Joined add_task(const JoiningTask& joining, Time now) = 0;

  /// A task leaves: no job of it starts any more and no sample may arrive for it; one that runs still ends
  /// with finished(). Visits what was released, due or unread, as unfinished() does. Time grows with the
  /// number of tasks and of queued jobs.
  virtual void remove_task(TaskId task, Time now, const Visitor& dropped) = 0;

  /// The given priority of a task, or whom it feeds, is another: jobs that are released from now on are
  /// ordered by that. Nothing happens where the order does not follow from it.
  virtual void change_task(TaskId task, const std::optional<std::int64_t>& priority,
                           const std::vector<TaskId>& feeds);

  /// For the exploration of all schedules. A copy in the same state; none: this scheduler is not explored.
  [[nodiscard]] virtual std::unique_ptr<Scheduler> clone() const { return nullptr; }
  /// Adds all that its later answers depend on, besides the numbers of the tasks and the calls to come.
  virtual void describe(StateWords& words) const { static_cast<void>(words); }
  /// The first instant after `now` at which an answer can change though nothing was called between: the next
  /// timestamp of a timer.
  [[nodiscard]] virtual Time next_change(Time now) const {
    static_cast<void>(now);
    return kNever;
  }
  /// Whether a job's deadline decides when the jobs run that it activates.
  [[nodiscard]] virtual bool hands_deadlines_down() const { return false; }

 protected:
  static void visit_due(const Timer& timer, Time now, const Visitor& visit);
  static void visit_unread(const UnreadSamples& unread, TaskId task, const Visitor& visit);
  /// What all schedulers have in common there: timers that are due, and unread samples.
  static void visit_unfinished(std::span<const Timer> timers, const UnreadSamples& unread, Time now,
                               const Visitor& visit);
  static Time next_timestamp(std::span<const Timer> timers, Time now);
};

/// One turn of a worker: release, then decide. Every driver advances a worker by this function and no other.
struct Turn {
  Decision decision;
  std::uint32_t released = 0;
};
Turn take_turn(Scheduler& scheduler, Worker worker, Time now);

}  // namespace hotpath
