// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace hotpath {

/// A thread-safe FIFO queue, bounded in items and in bytes. push() never blocks for space.
template <class Item>
class BoundedQueue {
 public:
  BoundedQueue(std::size_t max_items, std::size_t max_bytes) : max_items_(max_items), max_bytes_(max_bytes) {}

  /// Returns false and drops the item if the queue is full. An empty queue takes an item of any
  /// size.
  /// Rare items have twice the bounds, so that they are not lost among frequent ones.
  bool push(Item item, std::size_t bytes, bool rare = false) {
    const std::size_t times = rare ? 2 : 1;
    {
      const std::lock_guard lock(mutex_);
      const bool too_large = bytes_ + bytes > times * max_bytes_ && !items_.empty();
      if (items_.size() >= times * max_items_ || too_large) return false;
      items_.push_back({std::move(item), bytes});
      bytes_ += bytes;
    }
    arrived_.notify_one();
    return true;
  }

  /// std::nullopt if no item arrives by `deadline`.
  std::optional<Item> pop(std::chrono::steady_clock::time_point deadline) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_until(lock, deadline, [this] { return !items_.empty(); })) return std::nullopt;
    Entry entry = std::move(items_.front());
    items_.pop_front();
    bytes_ -= entry.bytes;
    return std::move(entry.item);
  }

 private:
  struct Entry {
    Item item;
    std::size_t bytes;
  };

  const std::size_t max_items_, max_bytes_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Entry> items_;
  std::size_t bytes_ = 0;
};

}  // namespace hotpath
