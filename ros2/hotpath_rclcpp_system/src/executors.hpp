// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <rclcpp/rclcpp.hpp>

#include "hotpath/core/registry.hpp"

namespace hotpath {

/// Creates the executor `entry` of a run's plan: rclcpp's own or PriorityExecutor. Throws
/// std::runtime_error if this rclcpp version lacks it.
[[nodiscard]] std::shared_ptr<rclcpp::Executor> make_executor(const ExecutorEntry& entry,
                                                              const nlohmann::json& plan);

/// Executor::is_spinning(), which is not virtual, or its replacement in EventsCBGExecutor.
[[nodiscard]] bool is_spinning(rclcpp::Executor& executor);

}  // namespace hotpath
