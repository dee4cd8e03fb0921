// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/workload.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/node_logic.hpp"
#include "hotpath/reference_system/task_history.hpp"

namespace hotpath {

/// The information of a message about its data, without the bytes.
class SimulatedMessage {
 public:
  /// Goes to `unused`, if given, when its last holder releases it.
  explicit SimulatedMessage(std::vector<SimulatedMessage*>* unused = nullptr) : unused_(unused) {}
  const std::vector<Stat>& history() const { return history_; }
  std::vector<Stat>& history() { return history_; }
  std::uint32_t publication() const { return publication_; }
  void publication(std::uint32_t number) { publication_ = number; }

 private:
  friend class SimulatedSample;
  /// Not inline: most destroyed holders are empty, and their check stays short.
  void give_back();
  std::vector<Stat> history_;
  std::uint32_t publication_ = 0;
  std::uint32_t holders_ = 0;
  std::vector<SimulatedMessage*>* const unused_;
};

using SimulatedHistory = TaskHistory<SimulatedMessage>;

/// A pool to which messages return when their last holder releases them. Holds as many messages as
/// were ever in use at once.
class SimulatedMessagePool {
 public:
  SimulatedMessage& take() {
    if (unused_.empty()) unused_.push_back(&all_.emplace_back(&unused_));
    SimulatedMessage& message = *unused_.back();
    unused_.pop_back();
    return message;
  }

 private:
  std::deque<SimulatedMessage> all_;
  std::vector<SimulatedMessage*> unused_;
};

/// A reference to a message; for one thread only.
class SimulatedSample {
 public:
  SimulatedSample() = default;
  explicit SimulatedSample(SimulatedMessage& message) : message_(&message) { ++message_->holders_; }
  SimulatedSample(const SimulatedSample& other) : message_(other.message_) {
    if (message_) ++message_->holders_;
  }
  SimulatedSample(SimulatedSample&& other) noexcept : message_(std::exchange(other.message_, nullptr)) {}
  SimulatedSample& operator=(SimulatedSample other) noexcept {
    std::swap(message_, other.message_);
    return *this;
  }
  ~SimulatedSample() {
    if (message_ && --message_->holders_ == 0) message_->give_back();
  }

  explicit operator bool() const { return message_ != nullptr; }
  const SimulatedMessage& operator*() const { return *message_; }

 private:
  SimulatedMessage* message_ = nullptr;
};

/// Samples in virtual time.
struct SimulatedMessages {
  using History = SimulatedHistory;
  using Held = SimulatedSample;
  static const SimulatedMessage& message(const SimulatedSample& held) { return *held; }
  static SimulatedSample share(const SimulatedSample& held) { return held; }
  struct Mutex {  ///< One thread only.
    void lock() {}
    void unlock() {}
  };
};

/// The machine of the graph's `platform`, for a simulation of the graph under `executor`.
Platform make_platform(const Graph& graph, const ExecutorEntry& executor);

/// The nodes of a graph in virtual time: the behaviour of live nodes (NodeLogic) with execution
/// times instead of work. Only working jobs take time: not jobs of a fusion that wait for another
/// input, nor subscriptions of cyclic nodes. Messages identify tasks, even if the graph's live
/// messages identify nodes.
class GraphWorkload final : public Workload {
 public:
  /// The arguments must outlive the workload. Observations of the chains' sinks are appended to
  /// `observations`, if given.
  GraphWorkload(const Graph& graph, const GraphTasks& tasks, const ExecutionTimes& times,
                std::vector<ChainObservation>* observations = nullptr);

  Duration start(const Job& job, Time now) override;
  [[nodiscard]] std::uint32_t end_round(const Job& job) const override { return times_.end_round(job); }
  std::span<const TaskId> finish(const Job& job, const Task& task, Time now) override;
  [[nodiscard]] std::optional<Duration> rest() const override { return rest_; }
  void delivered(TaskId subscription, std::uint64_t sequence, const JobRef& parent) override;
  void overwritten(TaskId subscription, std::uint64_t sequence) override;
  /// The copy appends to the same observations.
  [[nodiscard]] std::unique_ptr<Workload> clone() const override {
    return std::make_unique<GraphWorkload>(*this);
  }
  void describe(StateWords& words) const override;
  void describe(const Job& job, StateWords& words) const override;
  /// From now on, describe() has the publications of unread samples (exploration.hpp).
  void describe_publications() { with_publications_ = true; }

 private:
  struct OnTheWay {
    JobRef parent;
    SimulatedSample sample;
    const std::vector<TaskId>* readers;
    std::size_t deliveries;  ///< Number of subscriptions still to reach.
  };
  struct Unread {
    std::uint64_t sequence;
    SimulatedSample sample;
    JobRef parent;
  };

  /// A job that runs.
  struct Running : Activation<SimulatedMessages> {
    bool early = false;           ///< It publishes some message before its end.
    Duration time{}, done{};      ///< Its execution time, and that up to the end of its current part.
    std::vector<bool> published;  ///< By message; only if `early`.
  };

  /// Publishes the messages that are due into reached_; sets rest_.
  void publish_due(Running& job);
  /// The time from the start to the publication of a message, and to the next instant of publication or the
  /// end.
  [[nodiscard]] Duration instant_of(const Running& job, std::size_t message) const;
  [[nodiscard]] Duration next_instant(const Running& job) const;
  void publish(Running& job, std::size_t message);
  SimulatedSample take(TaskId subscription, std::uint64_t sequence);
  void observe(const SimulatedMessage& message, Activation<SimulatedMessages>& job);
  void describe(const SimulatedSample& sample, const std::vector<TaskId>& sources, StateWords& words) const;

  using Logic = NodeLogic<SimulatedMessages>;

  /// What no job changes, shared by copies.
  struct Structure {
    SimulatedHistory history;
    std::vector<ChainIndex> chains;
    std::vector<std::vector<std::uint32_t>> ends;  ///< By task: chains.
    /// By task and by node: entries of histories, of chains whose sinks its data can reach.
    std::vector<std::vector<TaskId>> sources, sources_of_nodes;
  };

  static std::shared_ptr<const Structure> structure_of(const Graph& graph, const GraphTasks& tasks);
  /// The node of a task, to be changed: no longer shared with copies.
  Logic& node_of(TaskId task) {
    std::shared_ptr<Logic>& node = nodes_[tasks_.origin[task].node];
    if (node.use_count() > 1) node = std::make_shared<Logic>(*node);
    return *node;
  }

  const GraphTasks& tasks_;
  const ExecutionTimes& times_;
  std::vector<ChainObservation>* const observations_;
  const std::shared_ptr<const Structure> structure_;
  // Declared before everything that holds messages.
  std::shared_ptr<SimulatedMessagePool> pool_ = std::make_shared<SimulatedMessagePool>();
  std::vector<std::shared_ptr<Logic>> nodes_;
  std::vector<std::vector<Unread>> unread_;  // by subscription, oldest first; at most its depth
  std::vector<Running> running_;             // the first busy_; the others are clear
  std::size_t busy_ = 0;
  bool with_publications_ = false;
  std::vector<TaskId> reached_;
  std::optional<Duration> rest_;
  std::vector<OnTheWay> on_the_way_;  // in the order of publication
};

/// The jobs of a measured trace that really worked, from which ReplayedTimes takes execution times
/// for a GraphWorkload; omits jobs that waited for others to complete a set. A task that never
/// completed a set gets the times of a task that did.
Trace working_jobs(const GraphTasks& tasks, const Trace& trace);

}  // namespace hotpath
