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
  /// Reads a YAML file whose keys are the members below, `service_wait` as `service_wait_ms`; others
  /// keep their defaults. `hotpath advise` writes such a file. Relative paths of `priorities` and
  /// `offsets`, and of `graph` if it is a path, refer to the file's folder. Throws hotpath's
  /// InputError (a std::runtime_error) with file and line. PriorityExecutor checks the values.
  static PriorityExecutorOptions from_file(const std::string& file);

  /// `rm-ro`, `rm-re`, `dm-*`, `edf-*`, `fp-*`, `events-ro`, `events-re` or `cbg`; `hotpath list
  /// executors` describes them. The paper's executors take the variants `:first` (subscriptions
  /// before all timers) and `:fifo` (ties by activation).
  std::string executor = "rm-ro";
  /// Number of threads that run callbacks, including the thread that calls spin(). Only
  /// release-only executors and `cbg` take more than one. Callbacks of a mutually exclusive group
  /// never overlap.
  unsigned threads = 1;
  /// YAML file with callback priorities for `fp-*` (format: docs/ros2.md). Empty: none.
  std::string priorities;
  /// A hotpath graph, as a path or a bare name; subscriptions inherit priorities along it. Empty:
  /// none.
  std::string graph;
  /// CSV file with the columns `task` and `first_release_ms`, one row for each timer of `graph`, as
  /// `hotpath advise --phases` writes it. A timer of the graph that joins the executor starts at the
  /// next instant of its grid: its offset plus a multiple of its period, counted from the zero of
  /// CLOCK_MONOTONIC, so that all processes of a machine share the grid. Needs `graph`. Timers on
  /// simulated time or that join cancelled are not moved; a reset leaves the grid. Empty: timers start when
  /// they are created.
  std::string offsets;
  /// Without a graph: learns at run time which callback feeds which, from samples that the
  /// middleware or intra-process communication delivers during the publication, in the same thread.
  bool learn = true;
  /// The paper's executors: a callback of a service, client, action or other waitable, or of
  /// `/parameter_events`, that has waited for this long runs next, whatever its priority. At most
  /// one of them does in any interval of this length. Zero: they wait for all more urgent callbacks.
  std::chrono::nanoseconds service_wait = std::chrono::milliseconds(100);
  /// Required policy (`fifo:90`, `other`, ...): spin() throws std::runtime_error if it is denied.
  /// Without a value, a release-only executor with one thread has no timer thread, and the paper's
  /// other executors raise theirs to SCHED_FIFO 90 if permitted; otherwise they log one warning.
  std::optional<std::string> timer_thread;
  /// Required policy of all threads that run callbacks. The thread that calls spin() keeps it
  /// afterwards.
  std::optional<std::string> executor_threads;
  /// Required policy of the threads in which the middleware receives samples, those that exist when
  /// spin() begins; they keep it afterwards. Give them a priority above `executor_threads` if those
  /// have a real-time policy: a sample of another process otherwise waits until they sleep.
  std::optional<std::string> middleware_threads;
};

/// The job that a callback serves.
struct RunningCallback {
  std::chrono::nanoseconds timestamp{};  ///< CLOCK_MONOTONIC; timers: nominal instant; others: arrival.
  std::chrono::nanoseconds release{};    ///< When the job entered the queue.
  std::uint64_t sequence = 0;            ///< Index of its timestamp or sample.
  std::uint32_t skipped = 0;             ///< Timers: number of skipped timestamps that follow.
};

/// The paper's executors, and the events executors of rclcpp as a comparison, for unpatched rclcpp.
/// A separate timer thread releases timers at their nominal instants (release-only) or also runs
/// them (release-and-execute; then a timer may overlap other callbacks of its mutually exclusive
/// group). With one thread and without a policy for a timer thread, the thread in spin() releases
/// timers itself, after each callback those that became due during it. In spin_some(), spin_all() and
/// spin_once() the calling thread does both.
/// hotpath_executor::core makes all scheduling decisions.
///
/// Throws std::invalid_argument for unknown or contradictory options, and hotpath's InputError (a
/// std::runtime_error) for invalid files. An exception of a callback propagates from spin() after
/// the other threads have ended; queued jobs stay queued.
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

  /// Sets a priority under `fp-*`; smaller values run first. A group's priority applies to its
  /// entities without their own. Under `rm-*`, `dm-*` and `edf-*`, services and clients take a
  /// priority in nanoseconds > 0: the period (`rm`) or relative deadline (`dm`, `edf`) of a timer
  /// with the same urgency; it replaces a learnt one. Callable from any thread, before or after the
  /// node is added. Throws std::invalid_argument for other entities and policies.
  void set_priority(const rclcpp::TimerBase::SharedPtr& timer, std::int64_t priority);
  void set_priority(const rclcpp::SubscriptionBase::SharedPtr& subscription, std::int64_t priority);
  void set_priority(const rclcpp::ServiceBase::SharedPtr& service, std::int64_t priority);
  void set_priority(const rclcpp::ClientBase::SharedPtr& client, std::int64_t priority);
  void set_priority(const rclcpp::CallbackGroup::SharedPtr& group, std::int64_t priority);

  /// Callbacks, most urgent first, each with its sort key: `/node@Timer(100000000): 100000000 ns`.
  /// Callable from any thread.
  [[nodiscard]] std::vector<std::string> priority_order() const;

  /// The threads of the current or last spin(), the caller first, each with its obtained policy:
  /// `executor other`, `timer_mgmt fifo:90`. Empty until all policies are set. Callable from any
  /// thread.
  [[nodiscard]] std::vector<std::string> thread_policies() const;

  /// The callback that the calling thread runs; std::nullopt outside a callback.
  [[nodiscard]] static std::optional<RunningCallback> running_callback();

 protected:
  void spin_once_impl(std::chrono::nanoseconds timeout) override;

 private:
  /// Marks this executor as spinning, or throws.
  void begin_to_spin(const char* what);

  const std::unique_ptr<PriorityExecutorParts> parts_;
};

}  // namespace hotpath
