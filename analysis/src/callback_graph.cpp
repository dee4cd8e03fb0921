// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/callback_graph.hpp"

#include <algorithm>
#include <limits>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

GraphTopology::GraphTopology(const CallbackGraph& graph)
    : graph_(graph),
      publishers_(size()),
      roots_(size()),
      timers_(set().timers()),
      join_(size(), graph.joins.size()) {
  std::vector<std::size_t> open(size(), 0);
  for (TaskId id = 0; id < size(); ++id) {
    for (const TaskId fed : set()[id].feeds) publishers_[fed].push_back(id);
  }
  for (std::size_t j = 0; j < graph.joins.size(); ++j) {
    join_work_.push_back(0);
    for (const TaskId input : graph.joins[j].inputs) {
      join_[input] = j;
      join_work_[j] = std::max(join_work_[j], set()[input].wcet.count());
    }
  }
  // All inputs of a join precede the tasks that it feeds, because all inputs are among the
  // publishers.
  for (TaskId id = 0; id < size(); ++id) {
    open[id] = publishers_[id].size();
    if (open[id] == 0) order_.push_back(id);
  }
  for (std::size_t i = 0; i < order_.size(); ++i) {
    for (const TaskId fed : set()[order_[i]].feeds) {
      if (--open[fed] == 0) order_.push_back(fed);
    }
  }
  if (order_.size() < size()) {
    throw AnalysisError("some subscriptions activate each other in a circle without a timer");
  }
  for (const TaskId id : order_) {
    if (set()[id].kind == TaskKind::timer) roots_[id].push_back(id);
    for (const TaskId p : publishers_[id]) {
      roots_[id].insert(roots_[id].end(), roots_[p].begin(), roots_[p].end());
    }
    std::sort(roots_[id].begin(), roots_[id].end());
    roots_[id].erase(std::unique(roots_[id].begin(), roots_[id].end()), roots_[id].end());
  }
}

bool GraphTopology::one_publisher(TaskId id) const {
  const std::vector<TaskId>& from = publishers_[id];
  return from.size() == 1 || (!from.empty() && std::all_of(from.begin(), from.end(), [&](TaskId p) {
           return join_of(p) != nullptr && join_[p] == join_[from.front()];
         }));
}

std::int64_t GraphTopology::least_until_start(TaskId root, TaskId to) const {
  constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  const auto [entry, is_new] = least_.try_emplace(root);
  auto& reached = entry->second;
  if (is_new) {
    std::vector<std::int64_t> start(size(), kNone);
    start[root] = 0;
    for (const TaskId id : order_) {
      for (const TaskId p : publishers_[id]) {
        if (start[p] != kNone) start[id] = std::min(start[id], exact::add(start[p], set()[p].bcet.count()));
      }
    }
    for (TaskId id = 0; id < size(); ++id) {
      if (start[id] != kNone) reached.emplace_back(id, start[id]);
    }
  }
  const auto target = std::ranges::lower_bound(reached, to, {}, &std::pair<TaskId, std::int64_t>::first);
  return target == reached.end() || target->first != to ? 0 : target->second;
}

std::vector<TaskId> GraphTopology::tasks_between(TaskId root, TaskId to) const {
  std::vector<TaskId> all = {to};
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i] == root) continue;
    for (const TaskId p : publishers(all[i])) {
      if (leads_to(root, p) && std::ranges::find(all, p) == all.end()) all.push_back(p);
    }
  }
  return all;
}

bool GraphTopology::alone(TaskId root, TaskId to) const {
  for (TaskId id = to; id != root; id = publishers_[id].front()) {
    if (publishers_[id].size() != 1) return false;
    const TaskId p = publishers_[id].front();
    if (join_of(p) != nullptr || graph_.every[p] > 1) return false;
  }
  return true;
}

}  // namespace hotpath
