// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/processing_windows.hpp"

#include <algorithm>
#include <functional>
#include <map>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply;

class ProcessingWindows final : public PathBounds {
 public:
  ProcessingWindows(const GraphTopology& topology, const std::vector<TaskId>& entity_order,
                    const GraphOverheads& overheads)
      : topology_(topology),
        overheads_(overheads),
        sequence_(in_order_of_kinds(topology.set(), entity_order)),
        position_(topology.size()) {
    for (std::size_t i = 0; i < sequence_.size(); ++i) position_[sequence_[i]] = i;
    whole_ = add(overheads_.wait, work(0, sequence_.size(), topology.graph().joins.size()));
  }

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override {
    return until_finish(root, to);  // a waiting job may start after a working job of its join
  }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override { return ends(root)[to]; }
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override {
    if (root == to) return 0;
    return *start_to_finish(root, to) - (job_work(to) - overheads_.job);
  }
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override {
    const std::vector<std::int64_t>& end = ends(root);
    return add(job_work(root), end[to] - end[root]);
  }
  std::int64_t lateness() const override { return overheads_.lateness; }
  std::optional<std::int64_t> response(TaskId subscription) const override {
    std::int64_t largest = 0;
    for (const TaskId p : topology_.publishers(subscription))
      largest = std::max(largest, hop(p, subscription));
    return largest;
  }
  /// By task of the longest path: the time since the end of the previous task.
  PathParts parts(TaskId root, TaskId to) const override {
    const std::vector<std::int64_t>& end = ends(root);
    PathParts parts;
    for (TaskId id = to; id != root;) {
      TaskId before = kNoTask;
      for (const TaskId p : topology_.publishers(id)) {
        if (end[p] >= 0 && end[p] + hop(p, id) == end[id]) before = p;
      }
      parts.work.emplace_back(id, end[id] - end[before]);
      id = before;
    }
    parts.work.emplace_back(root, end[root]);
    std::ranges::stable_sort(parts.work, std::greater<>(), [](const auto& part) { return part.second; });
    return parts;
  }

 private:
  /// Work of the tasks at these positions, each counted once; a join works once, and `without_join`
  /// not at all.
  std::int64_t work(std::size_t from, std::size_t to, std::size_t without_join) const {
    const std::size_t joins = topology_.graph().joins.size();
    std::vector<bool> counted(joins + 1, false);
    if (without_join < joins) counted[without_join] = true;
    std::int64_t sum = 0;
    for (std::size_t i = from; i < to; ++i) {
      const TaskId id = sequence_[i];
      if (topology_.roots(id).empty()) continue;
      const std::size_t join = topology_.join_index(id);
      const bool works = join == joins || !counted[join];
      sum = add(sum, works ? job_work(id) : overheads_.job);
      if (join != joins) counted[join] = true;
    }
    return sum;
  }
  /// Work of a job; for a join's input: of the longest job that completes the join.
  std::int64_t job_work(TaskId id) const {
    const bool joins = topology_.join_of(id) != nullptr;
    const std::int64_t wcet = topology_.set()[id].wcet.count();
    return add(joins ? topology_.join_work(topology_.join_index(id)) : wcet, overheads_.job);
  }
  /// Time from a poll that finds the task ready to the start of its job, which completes its join, if
  /// any.
  std::int64_t ahead(TaskId id) const {
    return add(overheads_.wait, work(0, position_[id], topology_.join_index(id)));
  }
  /// Time from the end of the task's job to the next poll.
  std::int64_t behind(TaskId id) const {
    return work(position_[id] + 1, sequence_.size(), topology_.join_index(id));
  }
  /// Ends of all tasks, relative to a timestamp of `root`; negative: not reached.
  const std::vector<std::int64_t>& ends(TaskId root) const {
    constexpr std::int64_t kUnreached = -1;
    const auto [entry, is_new] = ends_.try_emplace(root);
    std::vector<std::int64_t>& end = entry->second;
    if (!is_new) return end;
    end.assign(topology_.size(), kUnreached);
    // A timestamp that leads to a job falls into a window without the timer, or after the decision
    // for the timer's job in the window, which may precede the wait.
    end[root] =
        add(add(whole_, overheads_.wake_up), std::max(ahead(root), add(job_work(root), overheads_.wait)));
    for (const TaskId id : topology_.order()) {
      for (const TaskId p : topology_.publishers(id)) {
        if (end[p] != kUnreached) end[id] = std::max(end[id], add(end[p], hop(p, id)));
      }
    }
    return end;
  }
  /// Time from a publication to the end of the subscription's job that takes the sample.
  std::int64_t hop(TaskId publisher, TaskId subscription) const {
    const std::int64_t own = job_work(subscription);
    const Task& task = topology_.set()[subscription];
    const bool no_queue = task.depth == 1 || topology_.one_publisher(subscription);
    if (no_queue && overheads_.delivery == 0) {
      return add(behind(publisher), add(ahead(subscription), own));  // Lemma VI.5
    }
    // Lemma VI.4: one sample per window.
    const std::int64_t windows = multiply(task.depth, whole_);
    return add(add(overheads_.delivery, overheads_.wake_up), add(windows, add(ahead(subscription), own)));
  }

  const GraphTopology& topology_;
  const GraphOverheads overheads_;
  std::vector<TaskId> sequence_;                              // in the order of a window
  std::vector<std::size_t> position_;                         // by task
  std::int64_t whole_ = 0;                                    // longest window
  mutable std::map<TaskId, std::vector<std::int64_t>> ends_;  // filled on demand
};

}  // namespace

std::unique_ptr<PathBounds> processing_windows(const GraphTopology& topology,
                                               const std::vector<TaskId>& entity_order,
                                               const GraphOverheads& overheads) {
  return std::make_unique<ProcessingWindows>(topology, entity_order, overheads);
}

}  // namespace hotpath
