// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "hotpath/core/timer.hpp"

namespace hotpath {

/// The timers of a task set in a binary heap by Timer::due() (rclcpp experimental/timers_manager.hpp); the
/// paper's *timer release queue*. Timers that are due at one instant come in task order.
class TimersManager {
 public:
  void begin(const TaskSet& set, Time epoch);

  /// The timer's first timestamp is `epoch` plus its phase. O(n log n).
  void add(TaskId id, const Task& task, Time epoch);
  /// Returns the removed timer. O(n log n).
  Timer remove(TaskId id);

  /// When the head timer is due, kNever without timers.
  [[nodiscard]] Time next_due() const { return heap_.empty() ? kNever : heap_.front().due; }
  [[nodiscard]] bool due(Time now) const { return next_due() <= now; }

  /// The job of an always due timer has ended. O(n log n).
  void ended(TaskId id, Time now) { change(id, &Timer::ended, now); }

  /// Calls the head timer, which must be due, and restores the heap. O(log n).
  Job call_head(Time now);

  /// Calls the first due timer, in the order of the heap, for which `may_run` is true. O(n log n).
  std::optional<Job> call_first(Time now, const std::function<bool(TaskId)>& may_run);

  /// See ExploredScheduler::release_at(). O(n log n).
  void release_at(TaskId id, Time due) { change(id, &Timer::release_at, due); }
  /// See ExploredScheduler::released_by(). O(n log n).
  void released_by(Time now);
  void describe(StateWords& words) const;

  /// Removed timers are included, but never ready.
  [[nodiscard]] const std::vector<Timer>& timers() const { return timers_; }

 private:
  // Key and index side by side, so that sifting stays within the heap's own memory.
  struct Entry {
    Time due;
    std::uint32_t timer;
  };
  static bool before(const Entry& a, const Entry& b) {
    return a.due != b.due ? a.due < b.due : a.timer < b.timer;
  }
  void sift_down(std::size_t i);
  void change(TaskId id, void (Timer::*step)(Time), Time now);

  std::vector<Timer> timers_;
  std::vector<Entry> heap_;
};

/// ExploredScheduler::released_by() for timers with an order. `entries` are sorted by `before`, first of all
/// by the instant `due` of `timers[timer]`. Timestamps stay as they are: some schedule has this order.
template <class Entry, class Before>
void released_by(Time now, std::vector<Entry>& entries, std::vector<Timer>& timers, const Before& before) {
  for (std::size_t i = entries.size(); i-- > 0;) {
    Entry& entry = entries[i];
    Timer& timer = timers[entry.timer];
    if (!timer.is_released()) continue;
    entry.due = std::min(entry.due, now);
    if (i + 1 < entries.size() && !before(entry, entries[i + 1])) {
      entry.due = entries[i + 1].due;
      if (!before(entry, entries[i + 1])) entry.due -= Duration(1);
    }
    timer.release_at(entry.due);
  }
}

}  // namespace hotpath
