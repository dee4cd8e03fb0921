// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "hotpath/reference_system/task_history.hpp"

namespace hotpath {

/// The information of a message about its data, without the bytes.
class SimulatedMessage {
 public:
  const std::vector<Stat>& history() const { return history_; }
  std::vector<Stat>& history() { return history_; }
  std::uint32_t publication() const { return publication_; }
  void publication(std::uint32_t number) { publication_ = number; }

 private:
  friend class SimulatedSample;
  std::vector<Stat> history_;
  std::uint32_t publication_ = 0;
  std::uint32_t holders_ = 0;
};

using SimulatedHistory = TaskHistory<SimulatedMessage>;

/// A pool to which messages return when their last holder releases them. Holds as many messages as
/// were ever in use at once.
class SimulatedMessagePool {
 public:
  SimulatedMessage& take() {
    if (free_.empty()) free_.push_back(&all_.emplace_back());
    SimulatedMessage& message = *free_.back();
    free_.pop_back();
    return message;
  }
  /// Not inline: most destroyed holders are empty, and their check stays short.
  void give_back(SimulatedMessage& message);

 private:
  std::deque<SimulatedMessage> all_;
  std::vector<SimulatedMessage*> free_;
};

/// A reference to a message; for one thread only.
class SimulatedSample {
 public:
  SimulatedSample() = default;
  SimulatedSample(SimulatedMessagePool& pool, SimulatedMessage& message) : pool_(&pool), message_(&message) {
    ++message_->holders_;
  }
  SimulatedSample(const SimulatedSample& other) : pool_(other.pool_), message_(other.message_) {
    if (message_) ++message_->holders_;
  }
  SimulatedSample(SimulatedSample&& other) noexcept
      : pool_(other.pool_), message_(std::exchange(other.message_, nullptr)) {}
  SimulatedSample& operator=(SimulatedSample other) noexcept {
    std::swap(pool_, other.pool_);
    std::swap(message_, other.message_);
    return *this;
  }
  ~SimulatedSample() {
    if (message_ && --message_->holders_ == 0) pool_->give_back(*message_);
  }

  explicit operator bool() const { return message_ != nullptr; }
  const SimulatedMessage& operator*() const { return *message_; }

 private:
  SimulatedMessagePool* pool_ = nullptr;
  SimulatedMessage* message_ = nullptr;
};

}  // namespace hotpath
