// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "hotpath/fastdds/participant.hpp"
#include "hotpath/live/executor.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/message.hpp"
#include "hotpath/reference_system/node_logic.hpp"
#include "hotpath/reference_system/run_memory.hpp"
#include "hotpath/reference_system/work.hpp"

namespace hotpath {

enum class TransportKind : std::uint8_t { fastdds, intra_process };
constexpr auto enum_texts(TransportKind) {
  return std::to_array<EnumText<TransportKind>>(
      {{TransportKind::fastdds, "fastdds"}, {TransportKind::intra_process, "intra_process"}});
}

/// Samples on a live transport.
struct LiveMessages {
  using History = Message4kbHistory;
  using Held = Sample;
  using Mutex = std::mutex;
  static const msg::Message4kb& message(const Sample& held) { return held.as<msg::Message4kb>(); }
};

struct LiveOptions {
  const ExecutorEntry* executor = nullptr;
  SchedulerOptions scheduler;
  ExecutorOptions threads;
  TransportKind transport = TransportKind::fastdds;
  FastDdsOptions fastdds;
  Calibration calibration;
};

/// The nodes of a graph that live in this process (`tasks.set[id].local`), on a transport, driven by an
/// executor. First timestamps are the phases in `tasks`.
class LiveSystem final : private JobHandler {
 public:
  /// Throws TransportError.
  LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options, RunMemory& memory);
  ~LiveSystem();

  /// Waits until all endpoints of the graph, also those in other processes, know each other. Throws
  /// TransportError.
  void wait_until_matched(Time deadline) { transport_->wait_until_matched(deadline); }

  Executor& executor() { return *executor_; }

 private:
  struct Local {
    Local(std::uint32_t index, const Node& node, const Message4kbHistory& history, const Work& w)
        : logic(index, node, history), work(w) {}
    NodeLogic<LiveMessages> logic;
    Work work;
    std::vector<Transport<msg::Message4kb>::WriterId> writers;  // parallel to the node's outputs
    std::vector<std::uint32_t> sink_of;                         // chains
  };

  void run(const Job& job, Time start, Sample sample, Worker worker) override;
  void observe(const Local& node, const msg::Message4kb& message, const Job& job, Time start, Worker worker);

  const GraphTasks tasks_;
  const Message4kbHistory history_;
  const std::vector<ChainIndex> chains_;
  RunMemory& memory_;
  std::vector<RecordLog<ChainObservation>> chain_logs_;

  std::unique_ptr<Transport<msg::Message4kb>> transport_;
  std::deque<Local> locals_;
  std::vector<Local*> node_;  // by node index; nullptr: in another process
  std::unique_ptr<Executor> executor_;
};

}  // namespace hotpath
