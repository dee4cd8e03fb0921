// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "hotpath/fastdds/participant.hpp"
#include "hotpath/live/executor.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/number_cruncher.hpp"
#include "hotpath/reference_system/run_memory.hpp"

namespace hotpath {

enum class TransportKind : std::uint8_t { fastdds, intra_process };
constexpr auto enum_texts(TransportKind) {
  return std::to_array<EnumText<TransportKind>>(
      {{TransportKind::fastdds, "fastdds"}, {TransportKind::intra_process, "intra_process"}});
}

struct LiveOptions {
  const ExecutorEntry* executor = nullptr;
  SchedulerOptions scheduler;
  ExecutorOptions threads;
  TransportKind transport = TransportKind::fastdds;
  FastDdsOptions fastdds;
  Calibration calibration;
};

/// The nodes of a graph that live in this process (`tasks.set[id].local`), on a transport: what jobs do.
class LiveNodes : public JobHandler {
 public:
  virtual ~LiveNodes() = default;
  /// Creates the endpoints; samples go to `sink`. Throws TransportError.
  virtual void connect(SampleSink& sink) = 0;
  /// See Transport.
  virtual void wait_until_matched(Time deadline) = 0;
};

/// The nodes of a graph that live in this process, driven by an executor. Their messages are upstream's, or,
/// if the graph has nodes of type `callbacks`, TaskMessage. First timestamps are the phases in `tasks`.
class LiveSystem {
 public:
  /// Throws TransportError.
  LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options, RunMemory& memory);
  ~LiveSystem();

  /// Waits until all endpoints of the graph, also those in other processes, know each other. Throws
  /// TransportError.
  void wait_until_matched(Time deadline) { nodes_->wait_until_matched(deadline); }

  Executor& executor() { return *executor_; }

 private:
  std::unique_ptr<LiveNodes> nodes_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace hotpath
