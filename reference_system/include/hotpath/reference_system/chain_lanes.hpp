// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

struct ChainIndex;

/// The way of data along a chain. A source's data counts for a chain only if it reached the sink without
/// feedback edges. A feedback edge, a step of data from messages of one task to messages of another, lies
/// on a cycle of such edges and does not lead away from the sources: the number of edges from the nearest
/// source to its end is at most that to its beginning.
///
/// Where data of a source can also reach the sink through feedback, the messages' histories have an entry
/// of their own for the data that did not: a lane.
class ChainLanes {
 public:
  /// Task of the history entries of lanes: this bit, and the number of the lane.
  static constexpr TaskId kLane = TaskId{1} << 31U;
  static constexpr bool is_lane(TaskId entry) { return (entry & kLane) != 0; }

  ChainLanes() = default;
  ChainLanes(const Graph& graph, const GraphTasks& tasks);
  /// `next`: by task, the tasks whose messages have the data of its messages.
  ChainLanes(const std::vector<ChainIndex>& chains, const std::vector<std::vector<TaskId>>& next);

  [[nodiscard]] std::size_t size() const { return lanes_.size(); }
  /// The task of the history entry with the data of source `source` of chain `chain`, which is `task`:
  /// that task itself, if its data has no other way.
  [[nodiscard]] TaskId entry(std::uint32_t chain, std::size_t source, TaskId task) const;
  /// The source whose data an entry of a lane has.
  [[nodiscard]] TaskId source_of(TaskId entry) const { return lanes_[entry & ~kLane].source; }
  /// The entries of the lanes that begin with jobs of the task.
  [[nodiscard]] std::span<const TaskId> begins(TaskId task) const;
  /// Whether the lane's data goes on from a message of `from` to messages of `to`, or to a job of `to`
  /// that takes it.
  [[nodiscard]] bool keeps(TaskId entry, TaskId from, TaskId to) const;

 private:
  struct Lane {
    std::uint32_t chain = 0;
    std::size_t source_index = 0;
    TaskId source = 0;
    std::uint32_t edges = 0;  // index into edges_
  };
  std::vector<Lane> lanes_;
  std::vector<std::vector<TaskId>> begins_;                    // by task
  std::vector<std::vector<std::pair<TaskId, TaskId>>> edges_;  // by chain with lanes; sorted
};

}  // namespace hotpath
