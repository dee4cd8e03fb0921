// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/node_logic.hpp"
#include "hotpath/reference_system/simulated_message.hpp"

namespace hotpath {

/// Samples in virtual time.
struct SimulatedMessages {
  using History = SimulatedHistory;
  using Held = SimulatedSample;
  static const SimulatedMessage& message(const SimulatedSample& held) { return *held; }
  struct Mutex {  ///< One thread only.
    void lock() {}
    void unlock() {}
  };
};

/// The machine that the graph's `platform` describes, for a simulation of its nodes under `executor`.
Platform make_platform(const Graph& graph, const ExecutorEntry& executor);

/// The nodes of a graph in virtual time: the behaviour of live nodes (NodeLogic), with execution times
/// instead of work. Only jobs that really work take time: not those of a fusion that waits for another input,
/// nor subscriptions of cyclic nodes.
class GraphWorkload final : public Workload {
 public:
  /// The arguments must outlive the workload. What the sinks of the graph's chains find in their data is
  /// appended to `observations`, if given.
  GraphWorkload(const Graph& graph, const GraphTasks& tasks, const ExecutionTimes& times,
                std::vector<ChainObservation>* observations = nullptr);

  Duration start(const Job& job, Time now) override;
  bool finish(const Job& job, Time now) override;
  void delivered(TaskId subscription, std::uint64_t sequence, JobRef parent) override;
  void overwritten(TaskId subscription, std::uint64_t sequence) override;

 private:
  struct SimulatedNode {
    SimulatedNode(std::uint32_t index, const Node& node) : logic(index, node, kHistory) {}
    NodeLogic<SimulatedMessages> logic;
    std::vector<std::uint32_t> sink_of;  ///< Indices of chains.
  };
  struct Running {
    JobRef job;
    Activation<SimulatedMessages> activation;
  };
  struct OnTheWay {
    JobRef parent;
    SimulatedSample sample;
    std::size_t deliveries;  ///< Subscriptions that it has yet to reach.
  };
  struct Unread {
    std::uint64_t sequence;
    SimulatedSample sample;
  };

  /// What a job does at its end; true when it publishes.
  bool complete(const Job& job, Activation<SimulatedMessages>& activation);
  SimulatedSample take(TaskId subscription, std::uint64_t sequence);
  void observe(const SimulatedNode& node, const SimulatedMessage& message, const Job& job, Time start);

  static const SimulatedHistory kHistory;

  const GraphTasks& tasks_;
  const ExecutionTimes& times_;
  std::vector<ChainObservation>* const observations_;
  const std::vector<ChainIndex> chains_;
  SimulatedMessagePool pool_;  // before all that holds messages
  std::deque<SimulatedNode> nodes_;
  std::vector<std::vector<Unread>> unread_;  // per subscription, oldest first; as many as its depth
  std::vector<Running> running_;             // one per busy worker
  std::deque<OnTheWay> on_the_way_;
};

/// The jobs of a measured trace that really worked, from which ReplayedTimes takes execution times for a
/// GraphWorkload: the jobs of a fusion that waited for another input are left out. Of a fusion's inputs that
/// never completed a set, the times are those of one that did.
Trace working_jobs(const Graph& graph, const GraphTasks& tasks, const Trace& trace);

}  // namespace hotpath
