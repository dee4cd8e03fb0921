// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hotpath::results {

inline constexpr std::string_view kRclcppStack = "rclcpp";

/// The name of an executor on the command line and in results: `NAME[:VARIANT]...[@STACK]`. A stack
/// with a chosen middleware is `rclcpp-MIDDLEWARE`.
struct ExecutorLabel {
  std::string name;
  std::vector<std::string> variants;
  std::string stack;  ///< Empty: hotpath's own executors.

  /// Any text is a label; only the registry knows the valid ones.
  explicit ExecutorLabel(std::string_view text) {
    const std::size_t at = text.find('@');
    if (at != text.npos) stack = text.substr(at + 1);
    std::string_view rest = text.substr(0, at);
    name = rest.substr(0, rest.find(':'));
    while (rest.find(':') != rest.npos) {
      rest.remove_prefix(rest.find(':') + 1);
      variants.emplace_back(rest.substr(0, rest.find(':')));
    }
  }

  [[nodiscard]] bool on_rclcpp() const { return stack == kRclcppStack || !middleware().empty(); }
  /// Empty: the default of ROS 2, or no such stack.
  [[nodiscard]] std::string_view middleware() const {
    const std::string_view rest = stack;
    const bool chosen = rest.starts_with(kRclcppStack) && rest.substr(kRclcppStack.size()).starts_with('-');
    return chosen ? rest.substr(kRclcppStack.size() + 1) : std::string_view();
  }

  [[nodiscard]] std::string text() const {
    std::string text = name;
    for (const std::string& variant : variants) text += ":" + variant;
    return stack.empty() ? text : text + "@" + stack;
  }
};

}  // namespace hotpath::results
