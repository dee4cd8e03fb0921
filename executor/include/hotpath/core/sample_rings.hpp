// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// A ring of samples per subscription of a task set, sized by its history depth (KEEP_LAST). Memory
/// is allocated only when a task is added.
template <class Sample>
class SampleRings {
 public:
  explicit SampleRings(const TaskSet& set) {
    for (const Task& task : set.tasks) add_task(task);
  }

  void add_task(const Task& task) {
    Ring& ring = rings_.emplace_back();
    if (task.kind != TaskKind::subscription) return;
    assert(task.depth >= 1);
    ring.first = static_cast<std::uint32_t>(slots_.size());
    ring.depth = task.depth;
    slots_.resize(slots_.size() + task.depth);
  }

  [[nodiscard]] TaskId tasks() const { return static_cast<TaskId>(rings_.size()); }
  [[nodiscard]] bool is_subscription(TaskId task) const { return rings_[task].depth > 0; }
  [[nodiscard]] std::uint32_t count(TaskId task) const { return rings_[task].count; }

  /// Returns the oldest sample if the ring was full and this sample replaced it.
  [[nodiscard]] std::optional<Sample> push(TaskId task, Sample sample) {
    Ring& r = rings_[task];
    assert(r.depth > 0 && "not a subscription");
    std::optional<Sample> replaced;
    if (r.count == r.depth) replaced = pop(task);
    slots_[place(r, r.count)] = std::move(sample);
    ++r.count;
    return replaced;
  }

  /// Removes the oldest sample, which may be moved from its place. There must be one.
  [[nodiscard]] Sample&& pop(TaskId task) {
    Ring& r = rings_[task];
    assert(r.count > 0);
    Sample& sample = slots_[place(r, 0)];
    if (++r.head == r.depth) r.head = 0;
    --r.count;
    return std::move(sample);
  }

  /// The i-th oldest sample, i < count(task).
  [[nodiscard]] const Sample& peek(TaskId task, std::uint32_t i) const {
    assert(i < rings_[task].count);
    return slots_[place(rings_[task], i)];
  }

  /// Empties all rings; returns their samples mixed with empty ones.
  [[nodiscard]] std::vector<Sample> clear() {
    for (Ring& r : rings_) r.head = r.count = 0;
    return std::exchange(slots_, std::vector<Sample>(slots_.size()));
  }

 private:
  struct Ring {
    std::uint32_t first = 0, depth = 0;  // [first, first + depth) of slots_
    std::uint32_t head = 0, count = 0;
  };
  static std::size_t place(const Ring& r, std::uint32_t i) {
    const std::uint32_t slot = r.head + i;  // below twice the depth, so that no division is needed
    return r.first + (slot < r.depth ? slot : slot - r.depth);
  }

  std::vector<Ring> rings_;
  std::vector<Sample> slots_;
};

}  // namespace hotpath
