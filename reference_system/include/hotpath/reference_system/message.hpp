// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Message4kb.h>
#include <TaskMessage.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/task_history.hpp"

namespace hotpath {

/// Sample management of the reference system (upstream's sample_management.hpp) on the 4096-byte
/// message, which identifies nodes by name.
class Message4kbHistory {
 public:
  using Message = msg::Message4kb;
  static constexpr std::size_t kCapacity = 63;
  static constexpr bool kNamesJobs = false;  ///< The sequences of the entries count publications.

  /// Converts the names of the tasks' nodes to char[48] with a terminating NUL.
  Message4kbHistory(const Graph& graph, const GraphTasks& tasks) {
    for (const TaskOrigin& origin : tasks.origin) {
      const std::string& name = graph.nodes[origin.node].name;
      auto& cell = names_.emplace_back();
      cell.fill('\0');
      std::memcpy(cell.data(), name.data(), std::min(name.size(), cell.size() - 1));
    }
  }

  static void reserve(Message&, std::size_t) {}
  /// The message has no room for lanes (ChainLanes): graphs with lanes use other messages.
  static TaskId entry(std::uint32_t, std::size_t, TaskId task) { return task; }
  static bool goes_on(const Message&, TaskId, TaskId) { return true; }
  static void clear(Message& m) { m.size(0); }

  /// Appends the publisher's entry, which is the last one of any message. Does nothing if the
  /// history is full.
  void append(Message& m, const Stat& stat, std::uint32_t publication) const {
    if (m.size() >= kCapacity) return;
    auto& entry = m.stats()[m.size()];
    entry.timestamp(static_cast<std::uint64_t>(to_ns(stat.start)));
    entry.sequence_number(publication);
    entry.dropped_samples(stat.dropped);
    entry.node_name() = names_[stat.task];
    m.size(m.size() + 1);
  }

  /// Adds the entries of `from`. Of two jobs of one node the one that started first stays, at its
  /// place in `into`: an age counts from the oldest source job in the data.
  static void merge(Message& into, const Message& from, TaskId) {
    const std::size_t before = into.size();
    std::size_t size = before;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const auto& entry = from.stats()[i];
      std::size_t known = 0;
      while (known < before && into.stats()[known].node_name() != entry.node_name()) ++known;
      if (known == before) {
        if (size < kCapacity) into.stats()[size++] = entry;
      } else if (entry.timestamp() < into.stats()[known].timestamp()) {
        into.stats()[known] = entry;
      }
    }
    into.size(size);
  }

  static std::uint32_t publication(const Message& m) {
    return m.size() == 0 ? 0 : m.stats()[m.size() - 1].sequence_number();
  }

  /// Calls `visit(Stat)` for the first entry of these tasks' node, if any.
  template <class Visit>
  void find(const Message& m, std::span<const TaskId> tasks, Visit&& visit) const {
    for (std::size_t i = 0; i < m.size(); ++i) {
      const auto& entry = m.stats()[i];
      if (entry.node_name() != names_[tasks.front()]) continue;
      return visit(Stat{tasks.front(), entry.dropped_samples(), entry.sequence_number(),
                        from_ns(static_cast<std::int64_t>(entry.timestamp()))});
    }
  }

 private:
  std::vector<std::array<char, 48>> names_;  // by task
};

// Templates find the functions of a message by argument-dependent lookup.
namespace msg {

/// Writes the result of the work into data[0] and the SampleInfo into data[1..4].
inline void complete(Message4kb& m, const SampleInfo& info, std::int64_t result) {
  m.data()[0] = result;
  m.data()[1] = to_ns(info.published);
  m.data()[2] = to_ns(info.deadline);
  m.data()[3] = info.parent.task;
  m.data()[4] = static_cast<std::int64_t>(info.parent.sequence);
}

/// Whether a node of a graph with this number of tasks may have published the message.
inline bool is_message_of(const Message4kb& m, TaskId tasks) {
  const auto instant = [](std::int64_t ns) { return ns >= 0; };
  if (m.size() == 0 || m.size() > Message4kbHistory::kCapacity) return false;
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (!instant(static_cast<std::int64_t>(m.stats()[i].timestamp()))) return false;
  }
  return instant(m.data()[1]) && instant(m.data()[2]) && m.data()[3] >= 0 && m.data()[3] < tasks;
}

/// Reads the SampleInfo that complete() wrote.
inline SampleInfo read_info(const Message4kb& m) {
  return {from_ns(m.data()[1]),
          from_ns(m.data()[2]),
          {static_cast<TaskId>(m.data()[3]), static_cast<std::uint64_t>(m.data()[4])}};
}

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
