// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/task.hpp"

#include <cassert>

namespace hotpath {

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
