// SPDX-License-Identifier: Apache-2.0
// component_container under PriorityExecutor. Parameters and defaults: `config` (a file of all that
// follows, which other parameters override; none), `executor` (rm-ro),
// `threads` (1), `priorities`, `graph` and `offsets` (files; none), `learn` (true), `service_wait_ms` (100),
// `timer_thread`, `executor_threads` and `middleware_threads` (required policies; none).
#include <algorithm>
#include <chrono>
#include <limits>
#include <rclcpp_components/component_manager.hpp>

#include "hotpath_rclcpp/priority_executor.hpp"

namespace {

hotpath::PriorityExecutorOptions declare_options(rclcpp::Node& node) {
  hotpath::PriorityExecutorOptions options;
  const std::string config = node.declare_parameter("config", "");
  if (!config.empty()) options = hotpath::PriorityExecutorOptions::from_file(config);
  options.executor = node.declare_parameter("executor", options.executor);
  const std::int64_t threads = node.declare_parameter("threads", std::int64_t{options.threads});
  if (threads < 1 || threads > std::numeric_limits<unsigned>::max()) {
    throw std::invalid_argument("parameter `threads` is " + std::to_string(threads) +
                                ", but an executor needs at least one thread; set it to 1 or more");
  }
  options.threads = static_cast<unsigned>(threads);
  options.priorities = node.declare_parameter("priorities", options.priorities);
  options.graph = node.declare_parameter("graph", options.graph);
  options.offsets = node.declare_parameter("offsets", options.offsets);
  options.learn = node.declare_parameter("learn", options.learn);
  const auto usual = std::chrono::duration_cast<std::chrono::milliseconds>(options.service_wait);
  const auto wait_ms = node.declare_parameter("service_wait_ms", std::int64_t{usual.count()});
  if (wait_ms != usual.count())  // otherwise it keeps its fraction
    options.service_wait = std::chrono::milliseconds(std::clamp<std::int64_t>(wait_ms, -1, 1'000'000'000));
  const auto declare_policy = [&](const char* name, std::optional<std::string>& policy) {
    const std::string given = node.declare_parameter(name, policy.value_or(""));
    if (!given.empty()) policy = given;
  };
  declare_policy("timer_thread", options.timer_thread);
  declare_policy("executor_threads", options.executor_threads);
  declare_policy("middleware_threads", options.middleware_threads);
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  int code = 0;
  try {
    const auto manager = std::make_shared<rclcpp_components::ComponentManager>();
    const auto executor = std::make_shared<hotpath::PriorityExecutor>(declare_options(*manager));
    manager->set_executor(executor);
    executor->add_node(manager);
    executor->spin();
  } catch (const std::exception& error) {
    RCLCPP_FATAL(rclcpp::get_logger("component_container_hotpath"), "%s", error.what());
    code = 1;
  }
  rclcpp::shutdown();
  return code;
}
