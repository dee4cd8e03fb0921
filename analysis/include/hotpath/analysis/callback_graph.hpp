// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath {

/// A node graph from the perspective of the analyses: the activations between jobs, the joins, and
/// the sources of the data in messages.
struct CallbackGraph {
  /// Subscriptions that publish together (a fusion): a job works and publishes only if each of them
  /// has received a sample since the last publishing job. All feed the same tasks.
  struct Join {
    std::vector<TaskId> inputs;
  };
  /// A chain whose data age is bounded, from timers to the jobs of any of `sinks`.
  struct DataChain {
    std::string name;
    std::vector<TaskId> sources, sinks;
  };

  TaskSet set;
  bool phases_known = false;  ///< All runs have the phases of the timers in `set`.
  /// If phases are unknown: a timer's first timestamp is at most one period after its creation, and
  /// all timers are created within this time.
  Duration creation_spread{};
  /// Samples reach the subscriptions that a task feeds in the order of Task::feeds; otherwise in any order.
  bool delivery_known = true;
  std::vector<Join> joins;  ///< No task is in two joins.
  /// By task: the subscriptions whose newest samples enter its messages at the end of its job, each
  /// once.
  std::vector<std::vector<TaskId>> reads;
  /// By task: it publishes at least with every n-th job; >= 1.
  std::vector<std::uint32_t> every;
  std::vector<DataChain> chains;
};

/// Facts derived from a CallbackGraph alone. Tasks that no timer reaches never run.
class GraphTopology {
 public:
  /// The graph must outlive this object. Throws AnalysisError if subscriptions activate each other
  /// in a circle.
  explicit GraphTopology(const CallbackGraph& graph);

  [[nodiscard]] const CallbackGraph& graph() const { return graph_; }
  [[nodiscard]] const TaskSet& set() const { return graph_.set; }
  [[nodiscard]] TaskId size() const { return graph_.set.size(); }
  /// Topological order: every task follows the tasks that activate it.
  [[nodiscard]] const std::vector<TaskId>& order() const { return order_; }
  [[nodiscard]] const std::vector<TaskId>& publishers(TaskId id) const { return publishers_[id]; }
  [[nodiscard]] const std::vector<TaskId>& timers() const { return timers_; }
  /// The timers whose jobs lead to jobs of the task; a timer is its own root.
  [[nodiscard]] const std::vector<TaskId>& roots(TaskId id) const { return roots_[id]; }
  /// Whether jobs of the timer `root` lead to jobs of the task.
  [[nodiscard]] bool leads_to(TaskId root, TaskId id) const {
    return std::ranges::binary_search(roots_[id], root);
  }
  /// The tasks on the paths from the timer `root` to `to`, both included.
  [[nodiscard]] std::vector<TaskId> tasks_between(TaskId root, TaskId to) const;
  [[nodiscard]] const CallbackGraph::Join* join_of(TaskId id) const {
    return join_[id] < graph_.joins.size() ? &graph_.joins[join_[id]] : nullptr;
  }
  [[nodiscard]] std::size_t join_index(TaskId id) const { return join_[id]; }
  /// Longest execution time of a job that completes the join.
  [[nodiscard]] std::int64_t join_work(std::size_t join) const { return join_work_[join]; }

  /// Whether all samples come from a single task or a single join.
  [[nodiscard]] bool one_publisher(TaskId id) const;

  /// Lower bound on the time from a timestamp of `root` to the start of the resulting job of `to`:
  /// the sum of the best-case execution times of the tasks between, in ns.
  [[nodiscard]] std::int64_t least_until_start(TaskId root, TaskId to) const;
  /// Whether each job of `root` leads to a job of `to` along a single path without joins or other
  /// publishers.
  [[nodiscard]] bool alone(TaskId root, TaskId to) const;

 private:
  const CallbackGraph& graph_;
  std::vector<std::vector<TaskId>> publishers_, roots_;
  std::vector<TaskId> order_, timers_;
  std::vector<std::size_t> join_;
  std::vector<std::int64_t> join_work_;
  /// By root: the tasks that it leads to, ascending, each with its time. Filled on demand.
  mutable std::map<TaskId, std::vector<std::pair<TaskId, std::int64_t>>> least_;
};

}  // namespace hotpath
