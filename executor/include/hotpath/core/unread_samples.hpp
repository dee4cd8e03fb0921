// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// Unread samples of every subscription, each bounded by the subscription's history depth (KEEP_LAST).
class UnreadSamples {
 public:
  explicit UnreadSamples(const TaskSet& set);

  /// Adds a sample as a job of `task` without a release; returns the one it replaced when the history was
  /// full.
  struct Added {
    Job job;
    std::optional<Job> overwritten;
  };
  Added add(TaskId task, const SampleInfo& sample);

  TaskId tasks() const { return static_cast<TaskId>(readers_.size()); }
  bool is_subscription(TaskId task) const { return readers_[task].depth > 0; }
  std::uint32_t count(TaskId task) const { return readers_[task].count; }

  /// Removes the oldest unread sample. There must be one.
  Job take(TaskId task);

  /// The i-th oldest unread sample, i < count(task).
  Job peek(TaskId task, std::uint32_t i) const;

 private:
  struct Entry {
    std::uint64_t sequence;
    SampleInfo sample;
  };
  struct Reader {
    std::uint32_t first = 0, depth = 0;  // ring [first, first + depth) of entries_
    std::uint32_t head = 0, count = 0;
    std::uint64_t arrived = 0;
  };
  Job job(TaskId task, const Entry& e) const;

  std::vector<Reader> readers_;
  std::vector<Entry> entries_;
};

}  // namespace hotpath
