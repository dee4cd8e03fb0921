// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/tracing/system.hpp"

namespace hotpath::imports {

/// Inputs of a node whose latest samples enter its messages of a topic.
struct HeldInputs {
  std::uint32_t topic = 0;
  std::vector<TaskId> publishers, of;
};

/// Follows the data of chains through the jobs of a system, in a trace or while it runs: the history of a
/// job's messages joins those of the samples that the job took and that its node holds. Memory is bounded.
class ChainFollower {
 public:
  /// The message that a job took: its topic, and the job that published it, of task `by`.
  struct Taken {
    tracing::JobRef job;
    TaskId by = kNoTask;
    std::uint32_t topic = 0;
  };
  /// A chain ends with the messages of a sink that publishes, and otherwise with the end of its job.
  struct Rules {
    std::vector<ChainIndex> chains = {};
    std::vector<HeldInputs> held = {};
    std::vector<std::size_t> unread = {};  ///< By topic: the most messages of a task that may be unread.
    std::vector<bool> publishing = {};     ///< By task.
    ChainLanes lanes = {};                 ///< The ways of the chains' data.
  };
  using Observed = std::function<void(const ChainObservation&)>;

  /// `observed` receives each chain, during publish() or end() of the job that ends it.
  ChainFollower(Rules rules, Observed observed);

  // In the order of time, for jobs of tasks.
  void start(const tracing::JobRef& job, JobRef as, Time at, const std::optional<Taken>& taken);
  void publish(const tracing::JobRef& job, std::uint32_t topic);
  /// `ended`: false: the end was lost. Returns the job of the task; std::nullopt: its start was lost.
  std::optional<JobRef> end(const tracing::JobRef& job, bool ended);

  /// The most messages of a task that may be unread by a subscription of this depth; 0: keep all.
  [[nodiscard]] static std::size_t most_unread(std::uint32_t depth);

 private:
  using Message = std::shared_ptr<const SimulatedMessage>;
  struct Running {
    JobRef ref;
    Time start{};
    Message own;
    std::vector<std::uint32_t> observed;
  };
  using Key = std::pair<std::uint32_t, std::uint64_t>;
  static Key key_of(const tracing::JobRef& job) { return {job.callback, job.number}; }
  [[nodiscard]] Message message_of(const Taken& taken) const;
  void observe(const SimulatedMessage& message, Running& running);

  const Rules rules_;
  const Observed observed_;
  const SimulatedHistory history_;
  std::vector<std::vector<Message>> held_;  // by rule, by its inputs
  std::map<Key, Running> running_;
  /// By task and topic: its latest messages, with the keys of their jobs.
  std::map<std::pair<TaskId, std::uint32_t>, std::deque<std::pair<Key, Message>>> messages_;
};

}  // namespace hotpath::imports
