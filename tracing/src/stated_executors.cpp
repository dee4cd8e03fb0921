// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <string_view>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

void Assembler::state(const Event& e) {
  const Handle handle{e.process, e.number[0]}, of_entity{e.process, e.number[2]};
  if (e.kind == EventKind::executor_init) {
    executors_[handle] = static_cast<std::uint32_t>(system_.stated_executors.size());
    system_.stated_executors.push_back({e.process, e.text[0], e.text[1], {}, {}});
    return;
  }
  const std::uint32_t index = find(executors_, handle, kNone);
  if (index == kNone) return;  // recording began after its creation
  StatedExecutor& executor = system_.stated_executors[index];
  const std::pair task(index, e.number[1]);
  if (e.kind == EventKind::executor_callback) {
    const std::uint32_t callback = e.text[0] == std::string_view("timer")
                                       ? find(timers_, of_entity, {}).callback
                                       : find(subscriptions_, of_entity, kNone);
    callback_of_task_.erase(task);  // the executor may number its tasks anew
    if (callback != kNone) callback_of_task_[task] = callback;
  } else if (e.kind == EventKind::executor_priority) {
    const auto callback = callback_of_task_.find(task);
    if (callback != callback_of_task_.end())
      executor.levels[callback->second] = static_cast<std::int64_t>(e.number[2]);
  } else {
    executor.threads.insert(thread_of(e).index);
  }
}

}  // namespace hotpath::tracing
