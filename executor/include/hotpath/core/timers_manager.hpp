// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "hotpath/core/timer.hpp"

namespace hotpath {

/// The timers of a task set in a binary heap by Timer::due() (rclcpp experimental/timers_manager.hpp); the
/// paper's *timer release queue*. Timers that are due at one instant come in the order in which they began to
/// wait: at first, and always without take_head(), in task order.
class TimersManager {
 public:
  void begin(const TaskSet& set, Time epoch);

  /// The timer's first timestamp is `epoch` plus its phase. O(n log n).
  void add(TaskId id, const Task& task, Time epoch) {
    manage(id, task, epoch);
    std::sort(heap_.begin(), heap_.end(), before);
  }
  /// Returns the removed timer. O(n log n).
  Timer remove(TaskId id);

  /// When the head timer is due, kNever without timers.
  [[nodiscard]] Time next_due() const { return heap_.empty() ? kNever : heap_.front().due; }
  [[nodiscard]] bool due(Time now) const { return next_due() <= now; }
  /// Whether the timer thread must look again because this timer began to wait: for the head, and always with
  /// delays, which the thread does not foresee.
  [[nodiscard]] bool must_look_for(TaskId id) const {
    return any_delays_ || heap_.front().timer == index_[id];
  }

  /// The job of an always due timer has ended. O(n log n).
  void ended(TaskId id, Time now) { change(id, &Timer::ended, now); }

  /// Calls the head timer, which must be due, and restores the heap. O(log n).
  Job call_head(Time now);
  /// Calls the first due timer, in the order of the heap, for which `may_run` is true. O(n log n).
  std::optional<Job> call_first(Time now, const std::function<bool(TaskId)>& may_run);

  /// Removes the head timer from the heap, until it waits again. O(log n).
  TaskId take_head();
  /// Calls a timer that take_head() has returned.
  Job call(TaskId id, Time now) { return timers_[index_[id]].call(now); }
  /// The timer waits again. O(log n).
  void wait(TaskId id) {
    heap_.push_back({timers_[index_[id]].due(), waited_++, index_[id]});
    std::push_heap(heap_.begin(), heap_.end(), behind);
  }

  /// See ExploredScheduler::release_at(). O(n log n).
  void release_at(TaskId id, Time due) { change(id, &Timer::release_at, due); }
  /// See ExploredScheduler::released_by(). O(n log n).
  void released_by(Time now);
  /// Adds the state of all timers, and with delays their order.
  void describe(StateWords& words) const;
  /// Adds which timers wait, and in which order.
  void describe_waiting(StateWords& words) const;

  /// Removed timers are included, but never ready.
  [[nodiscard]] const std::vector<Timer>& timers() const { return timers_; }

 private:
  // Key and index side by side, so that sifting stays within the heap's own memory.
  struct Entry {
    Time due;
    std::uint64_t order;  // of insertion
    std::uint32_t timer;
  };
  static bool before(const Entry& a, const Entry& b) {
    return a.due != b.due ? a.due < b.due : a.order < b.order;
  }
  static bool behind(const Entry& a, const Entry& b) { return before(b, a); }
  void manage(TaskId id, const Task& task, Time epoch);
  void sift_down(std::size_t i);
  void change(TaskId id, void (Timer::*step)(Time), Time now);
  /// Those that do not wait too, as if they began to.
  [[nodiscard]] std::vector<Entry> all_in_order() const;

  std::vector<Timer> timers_;
  std::vector<std::uint32_t> index_;  // by task
  std::vector<Entry> heap_;
  std::uint64_t waited_ = 0;  // insertions into heap_ so far
  bool any_delays_ = false;   // of timers that may be ready later than at their timestamps
};

}  // namespace hotpath
