// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

/// As many entries as fit into 4096 bytes; further entries are dropped, as upstream does.
class BoundedHistory {
 public:
  static constexpr std::uint32_t kCapacity = 168;

  [[nodiscard]] const Stat* begin() const { return entries_.data(); }
  [[nodiscard]] const Stat* end() const { return entries_.data() + size_; }
  [[nodiscard]] Stat* begin() { return entries_.data(); }
  [[nodiscard]] Stat* end() { return entries_.data() + size_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  void reserve(std::size_t) {}
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
  std::uint32_t size_, padding_;
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
