// SPDX-License-Identifier: Apache-2.0
#include "executors.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hotpath/core/registry.hpp"
#include "hotpath_rclcpp/priority_executor.hpp"
#if RCLCPP_VERSION_GTE(21, 0, 0)
#include <rclcpp/experimental/executors/events_executor/events_executor.hpp>
#endif
#if __has_include(<rclcpp/executors/events_cbg_executor/events_cbg_executor.hpp>)
#include <rclcpp/executors/events_cbg_executor/events_cbg_executor.hpp>
#define HOTPATH_WITH_EVENTS_CBG_EXECUTOR
#elif defined(HOTPATH_WITH_CM_EXECUTORS)
#include <cm_executors/events_cbg_executor.hpp>
#define HOTPATH_WITH_EVENTS_CBG_EXECUTOR
#endif

namespace hotpath {

namespace {

using Made = std::shared_ptr<rclcpp::Executor>;

Made make_wait_set(const ExecutorTraits& traits, [[maybe_unused]] unsigned threads) {
  if (traits.many_workers) {
    return std::make_shared<rclcpp::executors::MultiThreadedExecutor>(rclcpp::ExecutorOptions(), threads);
  }
  if (traits.runs_first == TaskKind::timer) {
    return std::make_shared<rclcpp::executors::SingleThreadedExecutor>();
  }
#if !RCLCPP_VERSION_GTE(29, 0, 0)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  return std::make_shared<rclcpp::executors::StaticSingleThreadedExecutor>();
#pragma GCC diagnostic pop
#else
  return nullptr;
#endif
}

Made make_events([[maybe_unused]] const ExecutorTraits& traits) {
#if RCLCPP_VERSION_GTE(21, 0, 0)
  using namespace rclcpp::experimental::executors;
  const bool timer_thread_executes = traits.timers == TimerHandling::release_and_execute;
  return std::make_shared<EventsExecutor>(std::make_unique<SimpleEventsQueue>(), timer_thread_executes);
#else
  return nullptr;
#endif
}

Made make_callback_groups([[maybe_unused]] unsigned threads) {
#ifdef HOTPATH_WITH_EVENTS_CBG_EXECUTOR
  return std::make_shared<rclcpp::executors::EventsCBGExecutor>(rclcpp::ExecutorOptions(), threads);
#else
  return nullptr;
#endif
}

Made make_ours(const nlohmann::json& plan) {
  PriorityExecutorOptions options;
  options.executor = plan.at("executor");
  options.graph = plan.at("graph");
  if (plan.contains("timer_policy")) options.timer_thread = plan.at("timer_policy");
  if (plan.contains("executor_policy")) options.executor_threads = plan.at("executor_policy");
  return std::make_shared<PriorityExecutor>(options);
}

/// Null if this rclcpp version lacks the executor.
Made make(const ExecutorTraits& traits, const nlohmann::json& plan) {
  switch (traits.family) {
    case Family::wait_set:
      return make_wait_set(traits, plan.at("threads"));
    case Family::events:
      return make_events(traits);
    case Family::callback_groups:
      return make_callback_groups(plan.at("threads"));
    case Family::priority_events:
      return make_ours(plan);
  }
  return nullptr;
}

}  // namespace

Made make_executor(const ExecutorEntry& entry, const nlohmann::json& plan) {
  if (Made executor = entry.traits.on_rclcpp ? make(entry.traits, plan) : nullptr) return executor;
  throw std::runtime_error("rclcpp " + std::string(RCLCPP_VERSION_STR) + " has no " +
                           std::string(entry.class_name) + " for executor `" + std::string(entry.name) +
                           "`; remove it from --executors");
}

bool is_spinning(rclcpp::Executor& executor) {
#ifdef HOTPATH_WITH_EVENTS_CBG_EXECUTOR
  if (auto* const cbg = dynamic_cast<rclcpp::executors::EventsCBGExecutor*>(&executor)) {
    return cbg->is_spinning();
  }
#endif
  return executor.is_spinning();
}

}  // namespace hotpath
