// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "entry.hpp"
#include "setup.hpp"

namespace hotpath {

/// The scheduler of one executor, and what of rclcpp its tasks are. Serialised by the driver's lock. `now`
/// never decreases.
class Schedule {
 public:
  explicit Schedule(Setup setup);

  [[nodiscard]] Scheduler& scheduler() { return *scheduler_; }
  [[nodiscard]] const Setup& setup() const { return setup_; }

  /// The entry, which is in no schedule, gets a task; `first` is a timer's first release.
  WorkerSet join(const std::shared_ptr<Entry>& entry, Time first, Time now);
  /// No job of it starts any more; returns how many were released or unread.
  std::size_t leave(Entry& entry, Time now);

  /// Null: it was removed.
  [[nodiscard]] const std::shared_ptr<Entry>& entry(TaskId task) const { return entries_[task]; }
  /// Jobs that were released and did not start, events without a sample included, and timers that are due.
  [[nodiscard]] std::size_t queued(Time now) const;

  /// When nothing is queued and nothing runs: makes the scheduler anew once most of its tasks are gone, which
  /// keep their numbers for ever. Returns whether it did; then all workers must ask again.
  bool compact(Time now);

  /// A job of `from` published what arrived at `to`; true: that was not known.
  bool learn(TaskId from, const std::shared_ptr<Entry>& to);

  /// By hand. Throws std::invalid_argument when the policy has no given priorities.
  void set_priority(const std::shared_ptr<void>& entity, std::int64_t priority);

  /// From the most urgent on.
  [[nodiscard]] std::vector<std::string> order() const;
  /// What is said of each id of the priorities file that nothing has so far, and of a graph none of whose
  /// nodes is here so far.
  [[nodiscard]] std::vector<std::string> unmatched() const;

 private:
  using Handles = std::map<std::weak_ptr<void>, std::int64_t, std::owner_less<>>;

  [[nodiscard]] std::optional<TaskId> in_graph(const Entry& entry) const;
  [[nodiscard]] std::optional<std::int64_t> priority_of(const Entry& entry) const;
  [[nodiscard]] std::vector<TaskId> feeds_of(const Entry& entry) const;
  [[nodiscard]] std::vector<TaskId> feeders_of(const Entry& entry) const;
  Joined add(JoiningTask joining, Time now, std::shared_ptr<Entry> entry);
  void change(const Entry& entry);
  [[nodiscard]] std::vector<std::shared_ptr<Entry>> living() const;

  const Setup setup_;
  TaskSet set_;
  std::uint64_t generation_ = 1;  ///< Of the scheduler.
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::shared_ptr<Entry>> entries_;  // by task
  Handles by_hand_;
};

}  // namespace hotpath
