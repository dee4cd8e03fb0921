// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "entry.hpp"
#include "setup.hpp"

namespace hotpath {

/// The scheduler of one executor, with the rclcpp entity of each task. The driver's lock serialises
/// all calls. `now` never decreases.
class Schedule {
 public:
  explicit Schedule(Setup setup);

  [[nodiscard]] Scheduler& scheduler() { return *scheduler_; }
  [[nodiscard]] const Setup& setup() const { return setup_; }

  /// Adds a task for an entry that is in no schedule; `first` is a timer's first release.
  WorkerSet join(const std::shared_ptr<Entry>& entry, Time first, Time now);
  /// Removes the entry's task; none of its jobs starts any more. Returns the number of dropped
  /// jobs.
  std::size_t leave(Entry& entry, Time now);

  /// The given offset of a timer's releases, from the zero of CLOCK_MONOTONIC.
  [[nodiscard]] std::optional<Duration> offset_of(const Entry& entry) const;

  /// Null if the task was removed.
  [[nodiscard]] const std::shared_ptr<Entry>& entry(TaskId task) const { return entries_[task]; }
  /// Number of released jobs that have not started, including events without a sample, and of due
  /// timers.
  [[nodiscard]] std::size_t queued(Time now) const;

  /// Visits released jobs that have not started, and how long they have waited.
  void for_each_waiting(Time now,
                        const std::function<void(const std::shared_ptr<Entry>&, Duration)>& visit) const;
  /// The shortest period of the timers upstream, or the timer's own; 0: none is known.
  [[nodiscard]] Duration period_of(TaskId task);

  /// Rebuilds the scheduler if nothing is queued and most of its tasks are removed: removed tasks
  /// keep their numbers otherwise. Call it only while no job runs. Returns whether it did; then all
  /// workers must decide again.
  bool compact(Time now);

  /// Records that a job of `from` published a sample that arrived at `to`. Returns whether the edge
  /// is new.
  bool learn(TaskId from, const std::shared_ptr<Entry>& to);

  /// The deadline of a job that arrives at `now`; `inherited` is the deadline of the publishing job,
  /// kNever if that job is unknown.
  [[nodiscard]] Time deadline_of(const Entry& entry, Time inherited, Time now);

  /// `service`: the entity is a service or client. Throws std::invalid_argument if the policy does
  /// not take a priority for it.
  void set_priority(const std::shared_ptr<void>& entity, std::int64_t priority, bool service, Time now);

  /// Callbacks, most urgent first.
  [[nodiscard]] std::vector<std::string> order() const;
  /// Whether no timer and no given priority makes a callback more urgent than the least urgent ones.
  [[nodiscard]] bool runs_last(const Entry& entry) const;
  /// Whether the executor takes given priorities and has none.
  [[nodiscard]] bool lacks_priorities() const;
  /// Warnings for ids of the priorities file that match no entity yet, and for a graph that matches
  /// no node yet.
  [[nodiscard]] std::vector<std::string> unmatched() const;

 private:
  using Handles = std::map<std::weak_ptr<void>, std::int64_t, std::owner_less<>>;

  [[nodiscard]] std::optional<TaskId> in_graph(const Entry& entry) const;
  [[nodiscard]] std::optional<std::int64_t> priority_of(const Entry& entry) const;
  /// The period or deadline given to a service or client; never under `fp`.
  [[nodiscard]] std::optional<Duration> place_of(const Entry& entry) const;
  /// Makes the task that gives a service or client its place, if it has one.
  void give_place(const std::shared_ptr<Entry>& entry, Time now);
  /// Removes a task and counts its jobs.
  std::size_t drop(TaskId task, Time now);
  [[nodiscard]] std::vector<TaskId> feeds_of(const Entry& entry) const;
  [[nodiscard]] std::vector<TaskId> feeders_of(const std::shared_ptr<Entry>& entry) const;
  /// Records priorities that changed since the last call, if a session records them.
  void trace_priorities();
  void compute_upstream();
  Joined add(JoiningTask joining, Time now, std::shared_ptr<Entry> entry);
  void change(const Entry& entry);
  [[nodiscard]] std::vector<std::shared_ptr<Entry>> living() const;

  const Setup setup_;
  TaskSet set_;
  std::uint64_t generation_ = 1;  ///< Number of the current scheduler.
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::shared_ptr<Entry>> entries_;  // by task
  std::size_t alive_ = 0;                        ///< Number of entries that are not null.
  Handles by_hand_;
  // By task, from the timers upstream; 0: none.
  std::vector<Duration> periods_, deadlines_;
  bool stale_ = true;                                ///< These vectors are to be computed again.
  std::vector<std::optional<std::int64_t>> traced_;  ///< By task: the recorded priority.
};

}  // namespace hotpath
