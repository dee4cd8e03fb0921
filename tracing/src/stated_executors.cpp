// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string_view>
#include <utility>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

// An executor is not known if recording began after its creation.

void Assembler::on_executor_init(const Event& e) {
  executors_[{e.process, e.number[0]}] = static_cast<std::uint32_t>(system_.stated_executors.size());
  StatedExecutor& stated = system_.stated_executors.emplace_back();
  stated.process = e.process;
  stated.name = e.text[0];
}

void Assembler::on_executor_priority(const Event& e) {
  const std::uint32_t executor = find(executors_, {e.process, e.number[0]}, kNone);
  const auto callback = callback_of_task_.find({executor, e.number[1]});
  if (callback == callback_of_task_.end()) return;
  system_.stated_executors[executor].levels[callback->second] = static_cast<std::int64_t>(e.number[2]);
}

void Assembler::on_executor_end(const Event& e) {
  const std::uint32_t executor = find(executors_, {e.process, e.number[0]}, kNone);
  if (executor == kNone) return;
  system_.stated_executors[executor].states_ends = true;
  announce(e);
}

void Assembler::on_executor_callback(const Event& e) {
  const std::uint32_t executor = find(executors_, {e.process, e.number[0]}, kNone);
  if (executor == kNone) return;
  const Handle entity{e.process, e.number[2]};
  const std::string_view kind = e.text[0];
  std::uint32_t callback = kNone;
  if (kind == "timer") {
    callback = find(timers_, entity, {}).callback;
  } else if (kind == "client") {
    if (const std::uint32_t client = find(clients_, entity, kNone); client != kNone)
      callback = client_callback(client);
  } else if (kind == "service") {
    callback = find(service_callbacks_, entity, kNone);
  } else {
    callback = find(subscriptions_, entity, kNone);  // also of an intra-process waitable
  }
  const auto node = std::ranges::find(system_.nodes, e.text[1]);
  if (callback == kNone && node != system_.nodes.end() && (kind == "waitable" || kind == "client"))
    callback = unannounced_callback(static_cast<std::uint32_t>(node - system_.nodes.begin()), "waitables");
  const std::pair task(executor, e.number[1]);
  callback_of_task_.erase(task);  // the executor may number its tasks anew
  if (callback != kNone) callback_of_task_[task] = callback;
}

void Assembler::on_executor_job(const Event& e) {
  const std::uint32_t executor = find(executors_, {e.process, e.number[0]}, kNone);
  if (executor == kNone) return;
  ThreadState& thread = thread_of(e);
  system_.stated_executors[executor].threads.insert(thread.index);
  // Without events of their ends (older versions), jobs of clients and waitables do not count.
  if (std::exchange(thread.unannounced, false)) thread.open.clear();
  thread.timestamp = Time{Duration(static_cast<std::int64_t>(e.number[2]))};
  thread.release = Time{Duration(static_cast<std::int64_t>(e.number[3]))};
  const auto task = callback_of_task_.find({executor, e.number[1]});
  if (task == callback_of_task_.end() || !thread.open.empty()) return;
  const CallbackKind kind = system_.callbacks[task->second].kind;
  if (kind != CallbackKind::client && kind != CallbackKind::unannounced) return;
  std::optional<Response> response;
  if (kind == CallbackKind::client) {
    const auto client = std::ranges::find(system_.clients, task->second, &ServiceClient::callback);
    response = take_response(e.process, static_cast<std::uint32_t>(client - system_.clients.begin()));
  }
  begin_unannounced(thread, task->second, e.at, events_, response);
}

}  // namespace hotpath::tracing
