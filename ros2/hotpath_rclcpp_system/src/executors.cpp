// SPDX-License-Identifier: Apache-2.0
#include "executors.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hotpath_rclcpp/priority_executor.hpp"
#if RCLCPP_VERSION_GTE(21, 0, 0)
#include <rclcpp/experimental/executors/events_executor/events_executor.hpp>
#endif
#ifdef HOTPATH_WITH_CM_EXECUTORS
#include <cm_executors/events_cbg_executor.hpp>
#endif

namespace hotpath {

namespace {

std::shared_ptr<rclcpp::Executor> of_rclcpp(const std::string& name, unsigned threads) {
  const rclcpp::ExecutorOptions options;
  if (name == "default") return std::make_shared<rclcpp::executors::SingleThreadedExecutor>();
  if (name.rfind("multi", 0) == 0) {
    return std::make_shared<rclcpp::executors::MultiThreadedExecutor>(options, threads);
  }
#if !RCLCPP_VERSION_GTE(29, 0, 0)
  if (name == "static") {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
    return std::make_shared<rclcpp::executors::StaticSingleThreadedExecutor>();
#pragma GCC diagnostic pop
  }
#endif
#if RCLCPP_VERSION_GTE(21, 0, 0)
  if (name == "events-ro" || name == "events-re") {
    using namespace rclcpp::experimental::executors;
    return std::make_shared<EventsExecutor>(std::make_unique<SimpleEventsQueue>(), name == "events-re");
  }
#endif
#ifdef HOTPATH_WITH_CM_EXECUTORS
  if (name == "cbg") return std::make_shared<rclcpp::executors::EventsCBGExecutor>(options, threads);
#endif
  return nullptr;
}

}  // namespace

std::shared_ptr<rclcpp::Executor> make_executor(const nlohmann::json& plan) {
  const std::string text = plan.at("executor");
  const std::string name = text.substr(0, text.find(':'));
  if (auto executor = of_rclcpp(name, plan.at("threads"))) return executor;
  const bool priorities = name.size() > 3 && (name.rfind("rm-", 0) == 0 || name.rfind("dm-", 0) == 0 ||
                                              name.rfind("edf-", 0) == 0 || name.rfind("fp-", 0) == 0);
  if (!priorities) {
    throw std::runtime_error("rclcpp " + std::string(RCLCPP_VERSION_STR) + " has no executor `" + name +
                             "`; leave it out of --executors");
  }
  PriorityExecutorOptions options;
  options.executor = text;
  options.graph = plan.at("graph");
  if (plan.contains("timer_policy")) options.timer_thread = plan.at("timer_policy");
  if (plan.contains("executor_policy")) options.executor_threads = plan.at("executor_policy");
  return std::make_shared<PriorityExecutor>(options);
}

}  // namespace hotpath
