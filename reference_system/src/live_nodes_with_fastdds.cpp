// SPDX-License-Identifier: Apache-2.0
// Both transports, with the messages that fastddsgen makes.
#include <Message4kbPubSubTypes.h>
#include <TaskMessagePubSubTypes.h>

#include "hotpath/fastdds/fastdds_transport.hpp"
#include "hotpath/live/intra_process_transport.hpp"
#include "hotpath/reference_system/message.hpp"
#include "hotpath/reference_system/task_message.hpp"
#include "hotpath/reference_system/typed_live_nodes.hpp"
#include "make_live_nodes.hpp"

namespace hotpath {

bool has_fastdds() { return true; }

namespace {

template <class Messages>
std::unique_ptr<LiveNodes> make_nodes(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options,
                                      RunMemory& memory, const typename Messages::History& history) {
  using Message = typename Messages::Message;
  const auto reserve = [n = tasks.set.size()](Message& message) { Messages::History::reserve(message, n); };
  std::unique_ptr<Transport<Message>> transport;
  if (options.transport == TransportKind::intra_process) {
    transport = std::make_unique<IntraProcessTransport<Message>>(reserve);
  } else {
    transport = std::make_unique<FastDdsTransport<Messages>>(options.fastdds, tasks.set.size(), reserve);
  }
  return std::make_unique<TypedLiveNodes<Messages>>(graph, tasks, options.calibration, memory, history,
                                                    std::move(transport));
}

}  // namespace

std::unique_ptr<LiveNodes> make_live_nodes(const Graph& graph, const GraphTasks& tasks,
                                           const LiveOptions& options, RunMemory& memory) {
  using Messages4kb = LiveMessages<Message4kbHistory, msg::Message4kbPubSubType>;
  using TaskMessages = LiveMessages<TaskMessageHistory, msg::TaskMessagePubSubType>;
  if (graph.has_callbacks()) {
    return make_nodes<TaskMessages>(graph, tasks, options, memory, TaskMessageHistory());
  }
  return make_nodes<Messages4kb>(graph, tasks, options, memory, Message4kbHistory(graph, tasks));
}

}  // namespace hotpath
