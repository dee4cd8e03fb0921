// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// Sample management like Message4kbHistory, on a message whose history has any length and
/// identifies jobs by task. `Message` has `history()`, a vector of entries with task_of(),
/// stat_of() and set_stat(), and `publication()`, the number of its publisher's earlier
/// publications.
template <class M>
class TaskHistory {
 public:
  using Message = M;
  static constexpr bool kNamesJobs = true;  ///< The sequences of the entries are those of jobs.

  /// Reserves memory for one entry per task.
  static void reserve(Message& m, TaskId tasks) { m.history().reserve(tasks); }
  static void clear(Message& m) { m.history().clear(); }

  /// Appends the publisher's entry, which is the last one of any message, and removes an earlier
  /// one: a timer's publication may return to the timer through other tasks.
  static void append(Message& m, const Stat& stat, std::uint32_t publication) {
    auto& entries = m.history();
    const auto its = [&](const auto& e) { return task_of(e) == stat.task; };
    const auto before = std::find_if(entries.begin(), entries.end(), its);
    if (before != entries.end()) entries.erase(before);
    set_stat(entries.emplace_back(), stat);
    m.publication(publication);
  }

  /// Adds the entries of `from`. Of two jobs of one task the older one stays, at its place in
  /// `into`: an age counts from the oldest source job in the data.
  static void merge(Message& into, const Message& from) {
    auto& entries = into.history();
    const auto before = static_cast<std::ptrdiff_t>(entries.size());
    for (const auto& entry : from.history()) {
      const auto same = [&](const auto& e) { return task_of(e) == task_of(entry); };
      const auto known = std::find_if(entries.begin(), entries.begin() + before, same);
      if (known == entries.begin() + before) {
        entries.push_back(entry);
      } else if (stat_of(entry).sequence < stat_of(*known).sequence) {
        *known = entry;
      }
    }
  }

  static std::uint32_t publication(const Message& m) { return m.publication(); }

  /// Calls `visit(Stat)` for the first entry of one of these tasks, if any.
  template <class Visit>
  static void find(const Message& m, std::span<const TaskId> tasks, Visit&& visit) {
    for (const auto& entry : m.history()) {
      if (std::find(tasks.begin(), tasks.end(), task_of(entry)) != tasks.end()) return visit(stat_of(entry));
    }
  }
};

}  // namespace hotpath
