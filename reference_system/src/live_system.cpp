// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/live_system.hpp"

#include <Message4kbPubSubTypes.h>
#include <TaskMessagePubSubTypes.h>

#include "hotpath/reference_system/message.hpp"
#include "hotpath/reference_system/task_message.hpp"
#include "live_nodes.hpp"

namespace hotpath {

namespace {

std::unique_ptr<LiveNodes> make_nodes(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options,
                                      RunMemory& memory) {
  using Messages4kb = LiveMessages<Message4kbHistory, msg::Message4kbPubSubType>;
  using TaskMessages = LiveMessages<TaskMessageHistory, msg::TaskMessagePubSubType>;
  if (graph.has_callbacks()) {
    return std::make_unique<TypedLiveNodes<TaskMessages>>(graph, tasks, options, memory,
                                                          TaskMessageHistory());
  }
  return std::make_unique<TypedLiveNodes<Messages4kb>>(graph, tasks, options, memory,
                                                       Message4kbHistory(graph, tasks));
}

}  // namespace

LiveSystem::LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options,
                       RunMemory& memory)
    : nodes_(make_nodes(graph, tasks, options, memory)),
      executor_(std::make_unique<Executor>(tasks.set, options.executor->make(tasks.set, options.scheduler),
                                           *nodes_, memory.jobs(), options.threads)) {
  nodes_->connect(*executor_);
}

LiveSystem::~LiveSystem() {
  executor_->stop();
  executor_->join();
  // Samples go back to the transport while its readers exist, and its readers go before the executor they
  // call.
  executor_->close();
  nodes_.reset();
}

}  // namespace hotpath
