// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/core/sample_rings.hpp"

namespace hotpath {

/// Unread samples of every subscription, as jobs that have no release yet. Each subscription keeps
/// at most its history depth.
class UnreadSamples {
 public:
  explicit UnreadSamples(const TaskSet& set) : samples_(set), arrived_(set.size(), 0) {}

  void add_task(const Task& task) {
    samples_.add_task(task);
    arrived_.push_back(0);
  }
  void clear(TaskId task) {
    while (count(task) > 0) static_cast<void>(samples_.pop(task));
  }

  /// Returns the sample that the new one replaced if the history was full.
  [[nodiscard]] std::optional<Job> add(TaskId task, const SampleInfo& sample) {
    const auto replaced = samples_.push(task, {arrived_[task]++, sample});
    return replaced ? std::optional(job(task, *replaced)) : std::nullopt;
  }

  [[nodiscard]] TaskId tasks() const { return samples_.tasks(); }
  [[nodiscard]] bool is_subscription(TaskId task) const { return samples_.is_subscription(task); }
  [[nodiscard]] std::uint32_t count(TaskId task) const { return samples_.count(task); }

  /// Removes the oldest unread sample. There must be one.
  [[nodiscard]] Job take(TaskId task) { return job(task, samples_.pop(task)); }

  /// The i-th oldest unread sample, i < count(task).
  [[nodiscard]] Job peek(TaskId task, std::uint32_t i) const { return job(task, samples_.peek(task, i)); }
  /// The newest unread sample. There must be one.
  [[nodiscard]] Job newest(TaskId task) const { return peek(task, count(task) - 1); }

 private:
  struct Entry {
    std::uint64_t sequence = 0;
    SampleInfo sample;
  };
  static Job job(TaskId task, const Entry& e) {
    Job job;
    job.task = task;
    job.sequence = e.sequence;
    job.timestamp = e.sample.published;
    job.deadline = e.sample.deadline;
    job.parent = e.sample.parent;
    return job;
  }

  SampleRings<Entry> samples_;
  std::vector<std::uint64_t> arrived_;  // by task
};

}  // namespace hotpath
