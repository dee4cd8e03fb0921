// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <rclcpp/rclcpp.hpp>

#include "hotpath/core/registry.hpp"

namespace hotpath {

/// The executor of a run's plan, which `entry` names: rclcpp's own, or PriorityExecutor. Throws
/// std::runtime_error for one that this version does not have.
[[nodiscard]] std::shared_ptr<rclcpp::Executor> make_executor(const ExecutorEntry& entry,
                                                              const nlohmann::json& plan);

/// As Executor::is_spinning(), which is not virtual and which EventsCBGExecutor hides.
[[nodiscard]] bool is_spinning(rclcpp::Executor& executor);

}  // namespace hotpath
