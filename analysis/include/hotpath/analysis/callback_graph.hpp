// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/task.hpp"

namespace hotpath {

/// A node graph as the analyses see it: which jobs activate which, what waits for what, and where the data of
/// a message comes from.
struct CallbackGraph {
  /// Subscriptions that publish together: a job works and publishes only when each of them has had a sample
  /// since the last such job (a fusion). All feed the same tasks.
  struct Join {
    std::vector<TaskId> inputs;
  };
  /// Data whose age is bounded, from timers to the jobs of any of `sinks`.
  struct DataChain {
    std::string name;
    std::vector<TaskId> sources, sinks;
  };

  TaskSet set;
  bool phases_known = false;  ///< The timers' phases are those of every run.
  /// Otherwise a timer's first timestamp is at most its period behind its creation, and all timers are
  /// created within this time.
  Duration creation_spread{};
  std::vector<Join> joins;  ///< No task is in two.
  /// By task: the subscriptions whose newest samples go into its messages at the end of its job, each once.
  std::vector<std::vector<TaskId>> reads;
  /// By task: it publishes at least with every n-th job, >= 1.
  std::vector<std::uint32_t> every;
  std::vector<DataChain> chains;
};

/// What follows from a CallbackGraph alone. Tasks that no timer reaches never run.
class GraphTopology {
 public:
  /// The graph must outlive it. Throws AnalysisError when subscriptions activate each other in a circle.
  explicit GraphTopology(const CallbackGraph& graph);

  [[nodiscard]] const CallbackGraph& graph() const { return graph_; }
  [[nodiscard]] const TaskSet& set() const { return graph_.set; }
  [[nodiscard]] TaskId size() const { return graph_.set.size(); }
  /// Every task behind those that activate it.
  [[nodiscard]] const std::vector<TaskId>& order() const { return order_; }
  [[nodiscard]] const std::vector<TaskId>& publishers(TaskId id) const { return publishers_[id]; }
  [[nodiscard]] const std::vector<TaskId>& timers() const { return timers_; }
  /// The timers whose jobs lead to jobs of the task; of a timer: itself.
  [[nodiscard]] const std::vector<TaskId>& roots(TaskId id) const { return roots_[id]; }
  [[nodiscard]] const CallbackGraph::Join* join_of(TaskId id) const {
    return join_[id] < graph_.joins.size() ? &graph_.joins[join_[id]] : nullptr;
  }
  [[nodiscard]] std::size_t join_index(TaskId id) const { return join_[id]; }
  /// Longest execution time of a job that completes the join.
  [[nodiscard]] std::int64_t join_work(std::size_t join) const { return join_work_[join]; }

  /// Whether all samples come from one task, or from one join.
  [[nodiscard]] bool one_publisher(TaskId id) const;

  /// From a timestamp of `root` to the start of a job of `to` that it leads to: at least the best-case
  /// execution times of the tasks between.
  [[nodiscard]] std::int64_t least_until_start(TaskId root, TaskId to) const;
  /// Whether each job of `root` leads to a job of `to` along one way, past no join and no other publisher.
  [[nodiscard]] bool alone(TaskId root, TaskId to) const;

 private:
  const CallbackGraph& graph_;
  std::vector<std::vector<TaskId>> publishers_, roots_;
  std::vector<TaskId> order_, timers_;
  std::vector<std::size_t> join_;
  std::vector<std::int64_t> join_work_;
  /// By root: the tasks that it leads to, which ascend, each with its time. Filled when asked for.
  mutable std::map<TaskId, std::vector<std::pair<TaskId, std::int64_t>>> least_;
};

}  // namespace hotpath
