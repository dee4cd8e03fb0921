// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <TaskMessage.h>

#include <algorithm>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/task_history.hpp"

namespace hotpath {

// Templates find the functions of a message by argument-dependent lookup.
namespace msg {

inline TaskId task_of(const Contribution& entry) { return entry.task(); }

inline Stat stat_of(const Contribution& entry) {
  return {entry.task(), entry.dropped_samples(), entry.job(),
          from_ns(static_cast<std::int64_t>(entry.start()))};
}

inline void set_stat(Contribution& entry, const Stat& stat) {
  entry.task(stat.task);
  entry.dropped_samples(stat.dropped);
  entry.job(stat.sequence);
  entry.start(static_cast<std::uint64_t>(to_ns(stat.start)));
}

/// Writes the result of the work and the SampleInfo, whose parent is the history's last entry.
inline void complete(TaskMessage& m, const SampleInfo& info, std::int64_t result) {
  m.published(to_ns(info.published));
  m.deadline(to_ns(info.deadline));
  m.result(result);
}

/// Whether a task of a graph with this number of tasks may have published the message.
inline bool is_message_of(const TaskMessage& m, TaskId tasks) {
  const auto instant = [](std::int64_t ns) { return ns >= 0; };
  const auto known = [&](const Contribution& entry) {
    return (entry.task() < tasks || ChainLanes::is_lane(entry.task())) &&
           instant(static_cast<std::int64_t>(entry.start()));
  };
  return !m.history().empty() && m.history().back().task() < tasks && instant(m.published()) &&
         instant(m.deadline()) && std::all_of(m.history().begin(), m.history().end(), known);
}

/// Reads the SampleInfo; the message must satisfy is_message_of().
inline SampleInfo read_info(const TaskMessage& m) {
  const Contribution& publisher = m.history().back();
  return {from_ns(m.published()), from_ns(m.deadline()), {publisher.task(), publisher.job()}};
}

}  // namespace msg

using TaskMessageHistory = TaskHistory<msg::TaskMessage>;

}  // namespace hotpath
