// SPDX-License-Identifier: Apache-2.0
// Only the in-process transport, for builds without Fast DDS or without a generator for its
// messages.
#include "hotpath/live/intra_process_transport.hpp"
#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/task_history.hpp"
#include "hotpath/reference_system/typed_live_nodes.hpp"

namespace hotpath {

bool has_fastdds() { return false; }

std::unique_ptr<LiveNodes> make_live_nodes(const Graph& graph, const GraphTasks& tasks,
                                           const LiveOptions& options, RunMemory& memory) {
  if (options.transport != TransportKind::intra_process)
    throw TransportError("this build has no transport but intra_process");
  using Messages = LiveMessages<TaskHistory<BoundedMessage>>;
  return std::make_unique<TypedLiveNodes<Messages>>(
      graph, tasks, options.calibration, memory, Messages::History(ChainLanes(graph, tasks)),
      std::make_unique<IntraProcessTransport<BoundedMessage>>([](BoundedMessage&) {}));
}

}  // namespace hotpath
