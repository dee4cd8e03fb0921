// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/processing_windows.hpp"

#include <algorithm>
#include <functional>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::multiply;

ProcessingWindows::ProcessingWindows(const GraphTopology& topology, const std::vector<TaskId>& entity_order,
                                     const GraphOverheads& overheads)
    : topology_(topology),
      overheads_(overheads),
      sequence_(in_order_of_kinds(topology.set(), entity_order)),
      position_(topology.size()) {
  for (std::size_t i = 0; i < sequence_.size(); ++i) position_[sequence_[i]] = i;
  whole_ = add(overheads_.wait, work(0, sequence_.size(), topology.graph().joins.size()));
}

/// Work of a job; for a join's input: of the longest job that completes the join.
std::int64_t ProcessingWindows::job_work(TaskId id) const {
  const bool joins = topology_.join_of(id) != nullptr;
  const std::int64_t wcet = topology_.set()[id].wcet.count();
  return add(joins ? topology_.join_work(topology_.join_index(id)) : wcet, overheads_.job);
}

/// Work of the tasks at these positions, each counted once; a join works once, and `without_join`
/// not at all.
std::int64_t ProcessingWindows::work(std::size_t from, std::size_t to, std::size_t without_join) const {
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

/// Time from a poll that finds the task ready to the start of its job, which completes its join, if
/// any.
std::int64_t ProcessingWindows::ahead(TaskId id) const {
  return add(overheads_.wait, work(0, position_[id], topology_.join_index(id)));
}

/// Time from the end of the task's job to the next poll.
std::int64_t ProcessingWindows::behind(TaskId id) const {
  return work(position_[id] + 1, sequence_.size(), topology_.join_index(id));
}

/// Time from a publication to the end of the subscription's job that takes the sample.
std::int64_t ProcessingWindows::hop(TaskId publisher, TaskId subscription) const {
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

const std::vector<std::int64_t>& ProcessingWindows::ends(TaskId root) const {
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

std::optional<std::int64_t> ProcessingWindows::until_finish(TaskId root, TaskId to) const {
  return ends(root)[to];
}

PathParts ProcessingWindows::parts(TaskId root, TaskId to) const {
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

std::optional<std::int64_t> ProcessingWindows::until_start(TaskId root, TaskId to) const {
  return until_finish(root, to);  // a waiting job may start after a working job of its join
}

std::optional<std::int64_t> ProcessingWindows::start_to_finish(TaskId root, TaskId to) const {
  const std::vector<std::int64_t>& end = ends(root);
  return add(job_work(root), end[to] - end[root]);
}

std::optional<std::int64_t> ProcessingWindows::start_to_start(TaskId root, TaskId to) const {
  if (root == to) return 0;
  return *start_to_finish(root, to) - (job_work(to) - overheads_.job);
}

std::optional<std::int64_t> ProcessingWindows::response(TaskId subscription) const {
  std::int64_t largest = 0;
  for (const TaskId p : topology_.publishers(subscription)) largest = std::max(largest, hop(p, subscription));
  return largest;
}

}  // namespace hotpath
