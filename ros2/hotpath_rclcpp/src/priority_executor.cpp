// SPDX-License-Identifier: Apache-2.0
#include "hotpath_rclcpp/priority_executor.hpp"

#include <rcpputils/scope_exit.hpp>
#include <stdexcept>

#include "entities.hpp"
#include "loaded_libraries.hpp"
#include "middleware_threads.hpp"

namespace hotpath {

struct PriorityExecutorParts {
  explicit PriorityExecutorParts(const PriorityExecutorOptions& options,
                                 const rclcpp::Context::SharedPtr& context)
      : driver(std::make_shared<ExecutorDriver>(understand(options))),
        entities(driver, context),
        refresh([this] { entities.refresh(); }) {}

  const std::shared_ptr<ExecutorDriver> driver;
  Entities entities;
  const ExecutorDriver::Refresh refresh;
  std::atomic_bool options_checked{false};
};

namespace {

PriorityExecutorOptions named(const std::string& executor) {
  PriorityExecutorOptions options;
  options.executor = executor;
  return options;
}

void report_two_fast_dds() {
  const std::vector<std::string> files = loaded_fast_dds();
  if (files.size() < 2) return;
  RCLCPP_ERROR(rclcpp::get_logger("hotpath_rclcpp"),
               "Two versions of Fast DDS are loaded, %s and %s: expect crashes. Build hotpath with "
               "-DHOTPATH_FASTDDS=OFF, and link the program only to the Fast DDS of ROS 2.",
               files[0].c_str(), files[1].c_str());
}

Time after(std::chrono::nanoseconds duration) {
  const Time now = hotpath::now();
  return duration < kNever - now ? now + duration : kNever;
}

/// As in rclcpp, 0 is no limit.
Time end_of(std::chrono::nanoseconds max_duration) {
  if (max_duration < std::chrono::nanoseconds::zero()) {
    throw std::invalid_argument("max_duration must be greater than or equal to 0");
  }
  return max_duration.count() == 0 ? kNever : after(max_duration);
}

}  // namespace

PriorityExecutor::PriorityExecutor(const std::string& executor) : PriorityExecutor(named(executor)) {}

PriorityExecutor::PriorityExecutor(const PriorityExecutorOptions& options,
                                   const rclcpp::ExecutorOptions& rclcpp_options)
    : rclcpp::Executor(rclcpp_options),
      parts_(std::make_unique<PriorityExecutorParts>(options, rclcpp_options.context)) {
  report_two_fast_dds();
  versions::reference(interrupt_guard_condition_)
      .set_on_trigger_callback([driver = parts_->driver](std::size_t) { driver->wake_all(); });
  shutdown_guard_condition_->set_on_trigger_callback(
      [driver = parts_->driver](std::size_t) { driver->shut_down(); });
}

PriorityExecutor::~PriorityExecutor() {
  versions::reference(interrupt_guard_condition_).set_on_trigger_callback(nullptr);
  shutdown_guard_condition_->set_on_trigger_callback(nullptr);
}

void PriorityExecutor::begin_to_spin(const char* what) {
  if (spinning.exchange(true)) {
    throw std::runtime_error(std::string(what) + " called while already spinning");
  }
  parts_->driver->begin(true);
  if (!rclcpp::ok(context_)) parts_->driver->begin(false);
}

void PriorityExecutor::spin() {
  begin_to_spin("spin()");
  RCPPUTILS_SCOPE_EXIT(spinning.store(false););
  if (!parts_->options_checked.exchange(true)) {
    parts_->entities.refresh();
    parts_->driver->check_options();
  }
  if (const auto& policy = parts_->driver->setup().middleware_threads) set_middleware_policy(*policy);
  parts_->driver->spin(spinning, parts_->refresh);
}

void PriorityExecutor::spin_some(std::chrono::nanoseconds max_duration) {
  const Time until = end_of(max_duration);
  begin_to_spin("spin_some()");
  RCPPUTILS_SCOPE_EXIT(spinning.store(false););
  const std::size_t jobs = parts_->driver->queued(parts_->refresh);
  parts_->driver->run_some(spinning, parts_->refresh, jobs, until, Time{});
}

void PriorityExecutor::spin_all(std::chrono::nanoseconds max_duration) {
  const Time until = end_of(max_duration);
  begin_to_spin("spin_all()");
  RCPPUTILS_SCOPE_EXIT(spinning.store(false););
  parts_->driver->run_some(spinning, parts_->refresh, ExecutorDriver::kAllJobs, until, Time{});
}

void PriorityExecutor::spin_once_impl(std::chrono::nanoseconds timeout) {
  // The callers in rclcpp have already marked the executor as spinning.
  parts_->driver->begin(true);
  if (!rclcpp::ok(context_)) return;
  const Time until = timeout < std::chrono::nanoseconds::zero() ? kNever : after(timeout);
  parts_->driver->run_some(spinning, parts_->refresh, 1, kNever, until);
}

void PriorityExecutor::add_node(versions::NodeBaseArgument node, bool) { parts_->entities.add_node(node); }

void PriorityExecutor::add_node(versions::NodeArgument node, bool) {
  parts_->entities.add_node(node->get_node_base_interface());
}

void PriorityExecutor::remove_node(versions::NodeBaseArgument node, bool) {
  parts_->entities.remove_node(node);
}

void PriorityExecutor::remove_node(versions::NodeArgument node, bool) {
  parts_->entities.remove_node(node->get_node_base_interface());
}

void PriorityExecutor::add_callback_group(versions::GroupArgument group, versions::NodeBaseArgument node,
                                          bool) {
  parts_->entities.add_group(group, node);
}

void PriorityExecutor::remove_callback_group(versions::GroupArgument group, bool) {
  parts_->entities.remove_group(group);
}

std::vector<rclcpp::CallbackGroup::WeakPtr> PriorityExecutor::get_all_callback_groups() {
  return parts_->entities.groups(Entities::Added::any);
}

std::vector<rclcpp::CallbackGroup::WeakPtr> PriorityExecutor::get_manually_added_callback_groups() {
  return parts_->entities.groups(Entities::Added::by_hand);
}

std::vector<rclcpp::CallbackGroup::WeakPtr>
PriorityExecutor::get_automatically_added_callback_groups_from_nodes() {
  return parts_->entities.groups(Entities::Added::with_node);
}

void PriorityExecutor::set_priority(const rclcpp::TimerBase::SharedPtr& timer, std::int64_t priority) {
  parts_->driver->set_priority(timer, priority);
}
void PriorityExecutor::set_priority(const rclcpp::SubscriptionBase::SharedPtr& subscription,
                                    std::int64_t priority) {
  parts_->driver->set_priority(subscription, priority);
}
void PriorityExecutor::set_priority(const rclcpp::ServiceBase::SharedPtr& service, std::int64_t priority) {
  parts_->driver->set_priority(service, priority, true);
}
void PriorityExecutor::set_priority(const rclcpp::ClientBase::SharedPtr& client, std::int64_t priority) {
  parts_->driver->set_priority(client, priority, true);
}
void PriorityExecutor::set_priority(const rclcpp::CallbackGroup::SharedPtr& group, std::int64_t priority) {
  parts_->driver->set_priority(group, priority);
}

std::vector<std::string> PriorityExecutor::priority_order() const { return parts_->driver->order(); }

std::vector<std::string> PriorityExecutor::thread_policies() const {
  return parts_->driver->thread_policies();
}

std::optional<RunningCallback> PriorityExecutor::running_callback() {
  return ExecutorDriver::running_callback();
}

}  // namespace hotpath
