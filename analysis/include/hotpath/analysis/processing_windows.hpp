// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <vector>

#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/path_bounds.hpp"

namespace hotpath {

/// Processing windows of rclcpp's default executor (wait set, one thread): all callbacks that a
/// poll finds ready run before the next poll, each at most once, timers before subscriptions.
/// Follows Teper 2024 (lemmas VI.1 to VI.5) and adds the response time of the head timer, joins
/// that work at most once per window, and the platform's costs (docs/response_bounds.md, "Processing
/// windows").
class ProcessingWindows : public PathBounds {
 public:
  /// `entity_order`: all tasks in the order in which tasks of one kind are scanned; empty: order of
  /// creation. The topology must outlive this object.
  ProcessingWindows(const GraphTopology& topology, const std::vector<TaskId>& entity_order,
                    const GraphOverheads& overheads);

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override;
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override;
  std::int64_t lateness() const override { return overheads_.lateness; }
  std::optional<std::int64_t> response(TaskId subscription) const override;
  /// By task of the longest path: the time since the end of the previous task.
  PathParts parts(TaskId root, TaskId to) const override;

 private:
  std::int64_t work(std::size_t from, std::size_t to, std::size_t without_join) const;
  std::int64_t job_work(TaskId id) const;
  std::int64_t ahead(TaskId id) const;
  std::int64_t behind(TaskId id) const;
  /// Ends of all tasks, relative to a timestamp of `root`; negative: not reached.
  const std::vector<std::int64_t>& ends(TaskId root) const;
  std::int64_t hop(TaskId publisher, TaskId subscription) const;

  const GraphTopology& topology_;
  const GraphOverheads overheads_;
  std::vector<TaskId> sequence_;                              // in the order of a window
  std::vector<std::size_t> position_;                         // by task
  std::int64_t whole_ = 0;                                    // longest window
  mutable std::map<TaskId, std::vector<std::int64_t>> ends_;  // filled on demand
};

}  // namespace hotpath
