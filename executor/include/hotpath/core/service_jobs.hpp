// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/core/state_words.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath {

/// Queued jobs of services (Task::service), oldest first. Bounds their waiting time without giving them the
/// processor: a job that has waited for `wait` may start ahead of all others, and at least `wait`
/// passes between two such starts. For all other jobs this is one sporadic task above all
/// priorities, with `wait` as its minimum interarrival time.
class ServiceJobs {
 public:
  /// `wait` zero: no job is ever overdue.
  explicit ServiceJobs(Duration wait = {}) : wait_(wait) {}

  [[nodiscard]] bool limits_waits() const { return wait_ > Duration::zero(); }
  void arrived(TaskId task, Time now) { waiting_.push_back({task, now}); }  ///< Only if limits_waits().
  /// The oldest job of `task` started, or its event was consumed.
  void started(TaskId task) {
    const auto oldest = std::ranges::find(waiting_, task, &Waiting::task);
    if (oldest != waiting_.end()) waiting_.erase(oldest);
  }
  void removed(TaskId task) {
    std::erase_if(waiting_, [task](const Waiting& waiting) { return waiting.task == task; });
  }

  /// The task whose oldest job must run next, among the tasks that `may_run` accepts.
  template <class MayRun>
  [[nodiscard]] std::optional<TaskId> overdue(Time now, MayRun&& may_run) const {
    if (now < next_) return std::nullopt;
    for (const Waiting& waiting : waiting_) {
      if (waiting.since + wait_ > now) return std::nullopt;
      if (may_run(waiting.task)) return waiting.task;
    }
    return std::nullopt;
  }
  /// A job started because it was overdue.
  void started_overdue(Time now) { next_ = now + wait_; }

  void describe(StateWords& words) const {
    if (!limits_waits()) return;
    words.add(next_);
    for (const Waiting& waiting : waiting_) {
      words.add(waiting.task);
      words.add(waiting.since);
    }
  }
  /// The first instant after `now` at which overdue() may answer differently without further calls.
  [[nodiscard]] Time next_change(Time now) const {
    if (waiting_.empty()) return kNever;
    const Time overdue = std::max(next_, waiting_.front().since + wait_);
    return overdue > now ? overdue : kNever;
  }

 private:
  struct Waiting {
    TaskId task;
    Time since;
  };
  Duration wait_;
  Time next_{};  ///< No overdue job starts before.
  std::vector<Waiting> waiting_;
};

}  // namespace hotpath
