// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <span>

#include "hotpath/core/scheduler.hpp"
#include "hotpath/core/state_words.hpp"
#include "hotpath/core/timer.hpp"

namespace hotpath {

/// A scheduler that shows the state on which its decisions depend, for the exploration of all its schedules
/// (explore()). No driver of a single schedule needs it.
class ExploredScheduler : public Scheduler {
 public:
  /// A copy in the same state; none: with several workers that run jobs, it is not explored.
  [[nodiscard]] virtual std::unique_ptr<ExploredScheduler> clone() const { return nullptr; }
  /// Adds all that its later answers depend on, besides the numbers of the tasks and the calls to come.
  virtual void describe(StateWords& words) const = 0;
  /// The first instant after `now` at which an answer can change though nothing was called between: the next
  /// timestamp of a timer.
  [[nodiscard]] virtual Time next_change(Time now) const = 0;
  [[nodiscard]] virtual std::span<const Timer> timers() const = 0;
  /// A timer that Timer::is_held() becomes ready at `due`, which is now.
  virtual void release_at(TaskId timer, Time due) = 0;
  /// Every timer that release_at() made ready was so by `now`, in the same order: for another of the
  /// schedules that one state stands for, in which it is earlier.
  virtual void released_by(Time now) = 0;
  /// Whether a job's deadline decides when the jobs run that it activates.
  [[nodiscard]] virtual bool hands_deadlines_down() const { return false; }

 protected:
  static Time next_timestamp(std::span<const Timer> timers, Time now) {
    Time next = kNever;
    for (const Timer& timer : timers) next = std::min(next, timer.next_timestamp(now));
    return next;
  }
};

}  // namespace hotpath
