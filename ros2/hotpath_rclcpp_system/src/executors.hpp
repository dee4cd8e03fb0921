// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <rclcpp/rclcpp.hpp>

namespace hotpath {

/// The executor of a run's plan: rclcpp's `default`, `static`, `multi`, `events-ro`, `events-re`, `cbg`, or
/// PriorityExecutor. Throws std::runtime_error for one that this version does not have.
[[nodiscard]] std::shared_ptr<rclcpp::Executor> make_executor(const nlohmann::json& plan);

}  // namespace hotpath
