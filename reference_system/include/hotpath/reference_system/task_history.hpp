// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

inline TaskId task_of(const Stat& entry) { return entry.task; }
inline const Stat& stat_of(const Stat& entry) { return entry; }
inline void set_stat(Stat& entry, const Stat& stat) { entry = stat; }

/// Sample management like Message4kbHistory, on a message whose history has any length and
/// identifies jobs by task. `Message` has `history()`, a vector of entries with task_of(),
/// stat_of() and set_stat(), and `publication()`, the number of its publisher's earlier
/// publications.
template <class M>
class TaskHistory {
 public:
  using Message = M;
  static constexpr bool kNamesJobs = true;  ///< The sequences of the entries are those of jobs.

  TaskHistory() = default;
  explicit TaskHistory(ChainLanes lanes) : lanes_(std::make_shared<const ChainLanes>(std::move(lanes))) {}

  /// The task of the entry with the data of source `source` of a chain, which is `task`.
  [[nodiscard]] TaskId entry(std::uint32_t chain, std::size_t source, TaskId task) const {
    return lanes_->entry(chain, source, task);
  }
  [[nodiscard]] const ChainLanes& lanes() const { return *lanes_; }

  /// Reserves memory for so many entries.
  static void reserve(Message& m, std::size_t entries) { m.history().reserve(entries); }
  static void clear(Message& m) { m.history().clear(); }

  /// Appends the publisher's entry, which is the last one of any message, and removes an earlier
  /// one: a timer's publication may return to the timer through other tasks.
  void append(Message& m, const Stat& stat, std::uint32_t publication) const {
    for (const TaskId lane : lanes_->begins(stat.task)) replace(m, {lane, 0, stat.sequence, stat.start});
    replace(m, stat);
    m.publication(publication);
  }

  /// Adds the entries of `from` to a message of task `to`, without those of lanes that do not go there.
  /// Of two jobs of one task the older one stays, at its place in `into`: an age counts from the oldest
  /// source job in the data.
  void merge(Message& into, const Message& from, TaskId to) const {
    auto& entries = into.history();
    if (entries.size() == 0 && lanes_->size() == 0)
      return entries.assign(from.history().begin(), from.history().end());
    const std::size_t before = entries.size();
    std::size_t at = 0;  // where the search goes on: most entries that are in both have one order there
    for (const auto& entry : from.history()) {
      const TaskId task = task_of(entry);
      if (!goes_on(from, task, to)) continue;
      std::size_t left = before;
      for (; left > 0 && task_of(entries.begin()[at]) != task; --left) at = at + 1 < before ? at + 1 : 0;
      if (left == 0) {
        entries.push_back(entry);
      } else if (auto& known = entries.begin()[at]; stat_of(entry).sequence < stat_of(known).sequence) {
        known = entry;
      }
    }
  }

  static std::uint32_t publication(const Message& m) { return m.publication(); }

  /// Whether the entry of a message counts for a job of task `to` that took or published it.
  [[nodiscard]] bool goes_on(const Message& m, TaskId entry, TaskId to) const {
    if (!ChainLanes::is_lane(entry)) return true;
    return lanes_->keeps(entry, task_of(*std::prev(m.history().end())), to);
  }

  /// Calls `visit(Stat)` for the first entry of one of these tasks, if any.
  template <class Visit>
  static void find(const Message& m, std::span<const TaskId> tasks, Visit&& visit) {
    for (const auto& entry : m.history()) {
      if (std::find(tasks.begin(), tasks.end(), task_of(entry)) != tasks.end()) return visit(stat_of(entry));
    }
  }

 private:
  static void replace(Message& m, const Stat& stat) {
    auto& entries = m.history();
    const auto its = [&](const auto& e) { return task_of(e) == stat.task; };
    const auto before = std::find_if(entries.begin(), entries.end(), its);
    if (before != entries.end()) entries.erase(before);
    set_stat(entries.emplace_back(), stat);
  }

  std::shared_ptr<const ChainLanes> lanes_ = std::make_shared<const ChainLanes>();
};

/// As many entries as fit into 4096 bytes; further entries are dropped, as upstream does.
class BoundedHistory {
 public:
  static constexpr std::uint32_t kCapacity = 168;

  [[nodiscard]] const Stat* begin() const { return entries_.data(); }
  [[nodiscard]] const Stat* end() const { return entries_.data() + size_; }
  [[nodiscard]] Stat* begin() { return entries_.data(); }
  [[nodiscard]] Stat* end() { return entries_.data() + size_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  void clear() { size_ = 0; }
  /// Entries of a history.
  void assign(const Stat* first, const Stat* last) {
    size_ = static_cast<std::uint32_t>(std::copy(first, last, begin()) - begin());
  }
  Stat& emplace_back() { return entries_[size_ < kCapacity ? size_++ : kCapacity - 1]; }
  void erase(const Stat* entry) {
    Stat* const place = begin() + (entry - begin());
    std::copy(place + 1, end(), place);
    --size_;
  }
  void push_back(const Stat& entry) {
    if (size_ < kCapacity) entries_[size_++] = entry;
  }

 private:
  std::array<Stat, kCapacity> entries_;
  std::uint32_t size_;
};

/// The content of Message4kb, in at most 4096 bytes and without generated message code.
class __attribute__((may_alias)) BoundedMessage {
 public:
  [[nodiscard]] const BoundedHistory& history() const { return history_; }
  [[nodiscard]] BoundedHistory& history() { return history_; }
  [[nodiscard]] std::uint32_t publication() const { return publication_; }
  void publication(std::uint32_t number) { publication_ = number; }

 private:
  friend void complete(BoundedMessage& m, const SampleInfo& info, std::int64_t result) {
    m.result_ = result;
    m.published_ = to_ns(info.published);
    m.deadline_ = to_ns(info.deadline);
    m.parent_ = info.parent.task;
    m.parent_sequence_ = info.parent.sequence;
  }
  friend SampleInfo read_info(const BoundedMessage& m) {
    return {from_ns(m.published_), from_ns(m.deadline_), {m.parent_, m.parent_sequence_}};
  }

  BoundedHistory history_;
  std::int64_t result_, published_, deadline_;
  std::uint64_t parent_sequence_;
  std::uint32_t parent_, publication_;
};
static_assert(sizeof(BoundedMessage) <= 4096);

}  // namespace hotpath
