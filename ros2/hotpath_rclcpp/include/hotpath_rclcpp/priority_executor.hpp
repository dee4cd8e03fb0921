// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <vector>

#include "hotpath_rclcpp/versions.hpp"

namespace hotpath {

struct PriorityExecutorParts;

struct PriorityExecutorOptions {
  /// `rm-ro`, `rm-re`, `dm-*`, `edf-*`, `fp-*`, `events-ro`, `events-re`, `cbg`: `hotpath list executors`.
  /// The paper's take `:first` (subscriptions before all timers) and `:fifo` (ties by activation).
  std::string executor = "rm-ro";
  /// Threads that run callbacks, that of spin() among them; more than one with release-only executors and
  /// `cbg`. Mutually exclusive callback groups stay so.
  unsigned threads = 1;
  /// YAML with priorities of callbacks, docs/ros2.md; `fp-*`. Empty: none.
  std::string priorities;
  /// A graph of this project, a path or a bare name: subscriptions inherit priorities along it. Empty: none.
  std::string graph;
  /// Without a graph: who publishes during whose callback is learnt at run time, from samples that the
  /// middleware or intra-process communication delivers during the publication, in the same thread.
  bool learn = true;
  /// `fifo:90`, `other`, ...: asked for, so that spin() throws std::runtime_error when it is not obtained.
  /// Otherwise the paper's executors raise the timer thread to SCHED_FIFO 90 where that is permitted, and say
  /// so once where it is not.
  std::optional<std::string> timer_thread;
  /// For the thread that calls spin(), which keeps it, and the others that run callbacks.
  std::optional<std::string> executor_threads;
};

/// One callback as its executor sees it.
struct RunningCallback {
  std::chrono::nanoseconds timestamp{};  ///< CLOCK_MONOTONIC; timers: nominal; others: arrival.
  std::chrono::nanoseconds release{};    ///< When it entered the queue.
  std::uint64_t sequence = 0;            ///< Of the timestamp or sample of this callback.
  std::uint32_t skipped = 0;             ///< Timers: timestamps after it for which nothing ever runs.
};

/// The paper's executors, and those of rclcpp that they are compared with, for unpatched rclcpp. A timer
/// thread of its own releases the timers at their nominal instants (release-only), or runs them as well
/// (release-and-execute; then callback groups do not keep a timer and another callback apart). In spin_some()
/// and its kin the calling thread does both. All decisions are those of hotpath_executor::core.
///
/// Throws std::invalid_argument for options that say nothing it has, hotpath's InputError (a
/// std::runtime_error) for files. An exception of a callback leaves spin(), after the other threads have
/// ended; what was queued stays so.
class PriorityExecutor : public rclcpp::Executor {
 public:
  PriorityExecutor() : PriorityExecutor(PriorityExecutorOptions{}) {}
  explicit PriorityExecutor(const rclcpp::ExecutorOptions& options)
      : PriorityExecutor(PriorityExecutorOptions{}, options) {}
  explicit PriorityExecutor(const std::string& executor);
  explicit PriorityExecutor(const PriorityExecutorOptions& options,
                            const rclcpp::ExecutorOptions& rclcpp_options = rclcpp::ExecutorOptions());
  ~PriorityExecutor() override;

  void spin() override;
  void spin_some(std::chrono::nanoseconds max_duration = std::chrono::nanoseconds(0)) override;
  void spin_all(std::chrono::nanoseconds max_duration) override;

  void add_node(versions::NodeBaseArgument node, bool notify = true) override;
  void add_node(versions::NodeArgument node, bool notify = true) override;
  void remove_node(versions::NodeBaseArgument node, bool notify = true) override;
  void remove_node(versions::NodeArgument node, bool notify = true) override;
  void add_callback_group(versions::GroupArgument group, versions::NodeBaseArgument node,
                          bool notify = true) override;
  void remove_callback_group(versions::GroupArgument group, bool notify = true) override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_all_callback_groups() override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_manually_added_callback_groups() override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_automatically_added_callback_groups_from_nodes() override;

  /// Given priority under `fp-*`, the smaller first; of a group: for what has none of its own. Before or
  /// after its node was added, from any thread. Throws std::invalid_argument under another policy.
  void set_priority(const rclcpp::TimerBase::SharedPtr& timer, std::int64_t priority);
  void set_priority(const rclcpp::SubscriptionBase::SharedPtr& subscription, std::int64_t priority);
  void set_priority(const rclcpp::ServiceBase::SharedPtr& service, std::int64_t priority);
  void set_priority(const rclcpp::ClientBase::SharedPtr& client, std::int64_t priority);
  void set_priority(const rclcpp::CallbackGroup::SharedPtr& group, std::int64_t priority);

  /// Callbacks from the most urgent on: `/node@Timer(100000000)`, `/node@Subscription(/topic)`, each with
  /// what it is ordered by. Any thread.
  [[nodiscard]] std::vector<std::string> priority_order() const;

  /// The threads of the spin() that runs, or ran last, that of its caller first, each with the policy that it
  /// obtained: `executor other`, `timer_mgmt fifo:90`. Empty until all have theirs. Any thread.
  [[nodiscard]] std::vector<std::string> thread_policies() const;

  /// Of the callback that the calling thread is in; nothing outside of one.
  [[nodiscard]] static std::optional<RunningCallback> running_callback();

 protected:
  void spin_once_impl(std::chrono::nanoseconds timeout) override;

 private:
  /// Marks this executor as spinning, or throws.
  void begin_to_spin(const char* what);

  const std::unique_ptr<PriorityExecutorParts> parts_;
};

}  // namespace hotpath
