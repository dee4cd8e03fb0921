// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/task.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace hotpath {

std::vector<TaskId> TaskSet::timers() const {
  std::vector<TaskId> ids;
  for (TaskId id = 0; id < size(); ++id)
    if (tasks[id].kind == TaskKind::timer) ids.push_back(id);
  return ids;
}

std::vector<TaskId> in_order_of_kinds(const TaskSet& set, std::vector<TaskId> entity_order,
                                      TaskKind runs_first) {
  if (entity_order.empty()) {
    entity_order.resize(set.size());
    std::iota(entity_order.begin(), entity_order.end(), TaskId{0});
  }
  std::ranges::stable_sort(entity_order, {}, [&](TaskId id) { return place_of_kind(set[id], runs_first); });
  return entity_order;
}

TaskPart part_of(const TaskSet& whole, const std::vector<TaskId>& ids, const std::vector<TaskId>& urgent) {
  TaskPart part{{{}, {}}, ids};
  std::unordered_map<std::uint32_t, std::uint32_t> groups;
  std::unordered_map<TaskId, TaskId> numbers;  // ids in the part, timers only
  const auto add = [&](TaskId id) {
    Task& task = part.set.tasks.emplace_back(whole[id]);
    const auto [group, added] =
        groups.emplace(task.group, static_cast<std::uint32_t>(part.set.groups.size()));
    if (added) part.set.groups.push_back(whole.groups[task.group]);
    task.group = group->second;
    task.whole = id;
    task.feeds.clear();
    if (task.kind == TaskKind::timer) numbers.emplace(id, part.set.size() - 1);
  };
  for (const TaskId id : ids) add(id);
  for (TaskId number = 0; number < ids.size() && !urgent.empty(); ++number) {
    const TaskId timer = urgent[ids[number]];
    if (timer == kNoTask || part.set[number].kind == TaskKind::timer) continue;
    if (!numbers.contains(timer)) {
      add(timer);
      part.set.tasks.back().local = false;
    }
    part.set.tasks[numbers[timer]].feeds.push_back(number);
  }
  return part;
}

TaskId join(TaskSet& set, const JoiningTask& joining) {
  const TaskId id = set.size();
  assert(joining.task.group <= set.groups.size());
  if (joining.task.group == set.groups.size()) set.groups.push_back(joining.new_group);
  set.tasks.push_back(joining.task);
  for (const TaskId publisher : joining.fed_by) set.tasks[publisher].feeds.push_back(id);
  return id;
}

void leave(TaskSet& set, TaskId id) {
  set.tasks[id].local = false;
  set.tasks[id].feeds.clear();
  for (Task& task : set.tasks) std::erase(task.feeds, id);
}

}  // namespace hotpath
