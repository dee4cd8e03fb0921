// SPDX-License-Identifier: Apache-2.0
// Payloads of the graph's two message types as received from the network (the first byte selects
// the type), in the transport and in a node's history.
#include <Message4kbPubSubTypes.h>
#include <TaskMessagePubSubTypes.h>

#include "fuzz.hpp"
#include "hotpath/fastdds/guarded_type.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/message.hpp"

namespace {

using namespace hotpath;

/// Reads and copies a received message like a node.
template <class History, class PubSubType>
void receive(eprosima::fastrtps::rtps::SerializedPayload_t& payload, const GraphTasks& tasks,
             const History& history) {
  GuardedType<PubSubType> type;
  typename PubSubType::type message, output;
  if (!type.deserialize(&payload, &message) || !is_message_of(message, tasks.set.size())) return;
  static_cast<void>(read_info(message));
  History::clear(output);
  history.merge(output, message, 0);
  history.merge(output, message, 1);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    history.find(output, std::span(&id, 1), [](const Stat&) {});
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Graph autoware = load_graph(find_graph("autoware"));
  static const GraphTasks tasks = make_tasks(autoware),
                          callbacks = make_tasks(load_graph(find_graph("callbacks")));
  static const Message4kbHistory history(autoware, tasks);
  static const TaskMessageHistory lanes;
  if (size == 0) return 0;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(static_cast<std::uint32_t>(size));
  payload.length = static_cast<std::uint32_t>(size - 1);
  std::copy_n(data + 1, size - 1, payload.data);
  if (data[0] % 2 == 0) {
    receive<Message4kbHistory, msg::Message4kbPubSubType>(payload, tasks, history);
  } else {
    receive<TaskMessageHistory, msg::TaskMessagePubSubType>(payload, callbacks, lanes);
  }
  return 0;
}
