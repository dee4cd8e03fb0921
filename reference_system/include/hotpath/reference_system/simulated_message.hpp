// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// What a message of the reference system says about its data, without the 4096 bytes and the names.
struct SimulatedMessage {
  std::array<Stat, 63> stats;
  std::size_t size = 0;
  std::uint32_t holders = 0;
};

/// Sample management as Message4kbHistory has it, where nodes go by index.
class SimulatedHistory {
 public:
  using Message = SimulatedMessage;

  static void clear(Message& m) { m.size = 0; }

  /// The last entry of any message is its publisher's. Ignored when the history is full.
  static void append(Message& m, const Stat& stat) {
    if (m.size < m.stats.size()) m.stats[m.size++] = stat;
  }

  /// Appends the entries of nodes that `into` does not have yet, in order: the first occurrence wins.
  static void merge(Message& into, const Message& from) {
    const std::size_t before = into.size;
    for (std::size_t i = 0; i < from.size && into.size < into.stats.size(); ++i) {
      bool known = false;
      for (std::size_t k = 0; k < before && !known; ++k) known = into.stats[k].node == from.stats[i].node;
      if (!known) into.stats[into.size++] = from.stats[i];
    }
  }

  static std::uint32_t last_sequence(const Message& m) {
    return m.size == 0 ? 0 : m.stats[m.size - 1].sequence;
  }

  /// Calls `visit(Stat)` for the entry of `node`; false when there is none.
  template <class Visit>
  static bool find(const Message& m, std::uint32_t node, Visit&& visit) {
    for (std::size_t i = 0; i < m.size; ++i) {
      if (m.stats[i].node != node) continue;
      visit(m.stats[i]);
      return true;
    }
    return false;
  }
};

/// Messages that return here when their last holder lets go of them; as many as ever were held at once.
class SimulatedMessagePool {
 public:
  SimulatedMessage& take() {
    if (free_.empty()) free_.push_back(&all_.emplace_back());
    SimulatedMessage& message = *free_.back();
    free_.pop_back();
    return message;
  }
  /// Not inline: most holders that go hold nothing, and shall find that out quickly.
  void give_back(SimulatedMessage& message);

 private:
  std::deque<SimulatedMessage> all_;
  std::vector<SimulatedMessage*> free_;
};

/// One hold on a message. Not for more than one thread.
class SimulatedSample {
 public:
  SimulatedSample() = default;
  SimulatedSample(SimulatedMessagePool& pool, SimulatedMessage& message) : pool_(&pool), message_(&message) {
    ++message_->holders;
  }
  SimulatedSample(const SimulatedSample& other) : pool_(other.pool_), message_(other.message_) {
    if (message_) ++message_->holders;
  }
  SimulatedSample(SimulatedSample&& other) noexcept
      : pool_(other.pool_), message_(std::exchange(other.message_, nullptr)) {}
  SimulatedSample& operator=(SimulatedSample other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(message_, other.message_);
    return *this;
  }
  ~SimulatedSample() {
    if (message_ && --message_->holders == 0) pool_->give_back(*message_);
  }

  explicit operator bool() const { return message_ != nullptr; }
  const SimulatedMessage& operator*() const { return *message_; }

 private:
  SimulatedMessagePool* pool_ = nullptr;
  SimulatedMessage* message_ = nullptr;
};

}  // namespace hotpath
