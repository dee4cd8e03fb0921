// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath::explain {

/// A started job. A job that was running at the end of the run has the finish kNever.
struct Seen {
  JobRecord record;
  std::uint64_t order = 0;  ///< Counts the started jobs of the repetition, in order of start.
};

/// The started jobs of one repetition that ended recently, by task and by worker.
class JobWindow {
 public:
  /// `run` names the run in messages.
  JobWindow(TaskId tasks, std::string run) : run_(std::move(run)), by_task_(tasks) {}

  /// Adds a started job, in order of start, and returns it; valid until it is forgotten. Throws
  /// UsageError if the window needs too much memory.
  const Seen& add(const JobRecord& record);
  /// Forgets jobs that finished before `horizon`.
  void forget_before(Time horizon);
  void clear();

  /// nullptr: not in the window.
  [[nodiscard]] const Seen* find(JobRef job) const;
  /// In order of start.
  [[nodiscard]] const std::deque<Seen>& of_task(TaskId task) const { return by_task_[task]; }
  [[nodiscard]] std::size_t workers() const { return by_worker_.size(); }

  /// The jobs of a worker that ran at some time in [from, to), in order of start.
  [[nodiscard]] std::vector<const Seen*> overlapping(std::size_t worker, Time from, Time to) const;

 private:
  const std::string run_;
  std::vector<std::deque<Seen>> by_task_, by_worker_;
  std::size_t jobs_ = 0, checked_ = 1U << 20;
  std::uint64_t next_order_ = 0;
};

}  // namespace hotpath::explain
