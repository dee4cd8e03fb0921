// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Message4kb.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// Sample management of the reference system (upstream's sample_management.hpp) on the 4096-byte message,
/// where nodes go by name.
class Message4kbHistory {
 public:
  using Message = msg::Message4kb;
  static constexpr std::size_t kCapacity = 63;

  /// Node names, which become char[48] with a terminating NUL.
  explicit Message4kbHistory(const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      auto& cell = names_.emplace_back();
      cell.fill('\0');
      std::memcpy(cell.data(), name.data(), std::min(name.size(), cell.size() - 1));
    }
  }

  static void clear(Message& m) { m.size(0); }

  /// The last entry of any message is its publisher's. Ignored when the history is full.
  void append(Message& m, const Stat& stat) const {
    if (m.size() >= kCapacity) return;
    auto& entry = m.stats()[m.size()];
    entry.timestamp(static_cast<std::uint64_t>(to_ns(stat.start)));
    entry.sequence_number(stat.sequence);
    entry.dropped_samples(stat.dropped);
    entry.node_name() = names_[stat.node];
    m.size(m.size() + 1);
  }

  /// Appends the entries of nodes that `into` does not have yet, in order: the first occurrence of a name
  /// wins.
  static void merge(Message& into, const Message& from) {
    const std::size_t before = into.size();
    std::size_t size = before;
    for (std::size_t i = 0; i < from.size() && size < kCapacity; ++i) {
      const auto& entry = from.stats()[i];
      bool known = false;
      for (std::size_t k = 0; k < before && !known; ++k) {
        known = into.stats()[k].node_name() == entry.node_name();
      }
      if (!known) into.stats()[size++] = entry;
    }
    into.size(size);
  }

  static std::uint32_t last_sequence(const Message& m) {
    return m.size() == 0 ? 0 : m.stats()[m.size() - 1].sequence_number();
  }

  /// Calls `visit(Stat)` for the entry of `node`; false when there is none.
  template <class Visit>
  bool find(const Message& m, std::uint32_t node, Visit&& visit) const {
    for (std::size_t i = 0; i < m.size(); ++i) {
      const auto& entry = m.stats()[i];
      if (entry.node_name() != names_[node]) continue;
      visit(Stat{node, entry.sequence_number(), entry.dropped_samples(),
                 from_ns(static_cast<std::int64_t>(entry.timestamp()))});
      return true;
    }
    return false;
  }

 private:
  std::vector<std::array<char, 48>> names_;
};

/// Writes what a reader needs to know of its sample into data[1..4].
inline void write_info(msg::Message4kb& m, const SampleInfo& info) {
  m.data()[1] = to_ns(info.published);
  m.data()[2] = to_ns(info.deadline);
  m.data()[3] = info.parent.task;
  m.data()[4] = static_cast<std::int64_t>(info.parent.sequence);
}

inline SampleInfo read_info(const msg::Message4kb& m) {
  return {from_ns(m.data()[1]),
          from_ns(m.data()[2]),
          {static_cast<TaskId>(m.data()[3]), static_cast<std::uint64_t>(m.data()[4])}};
}

}  // namespace hotpath
