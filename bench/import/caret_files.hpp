// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "hotpath/reference_system/callback.hpp"

namespace hotpath::imports {

/// CARET's architecture.yaml, with its names. The name UNDEFINED (unknown to CARET) is empty.
struct CaretCallback {
  std::string name;
  std::optional<std::string> topic;  ///< Subscriptions.
  Duration period{};                 ///< Timers.
};
struct CaretGroup {
  std::string name;
  CallbackGroup kind = CallbackGroup::mutually_exclusive;
  std::vector<std::string> callbacks;
};
struct CaretPublication {
  std::string topic;
  std::vector<std::string> callbacks;  ///< Empty: unknown.
};
/// Messages of one topic contain the newest sample of another topic.
struct CaretContext {
  std::string subscribed, published;
};
struct CaretNode {
  std::string name;
  std::vector<CaretCallback> callbacks;  ///< Timers and subscriptions.
  std::vector<CaretGroup> groups;
  std::vector<CaretPublication> publications;
  std::vector<CaretContext> contexts;
};
struct CaretExecutor {
  std::string name;
  bool multi_threaded = false;
  std::vector<std::string> groups;
};
/// One node of a named path, with the topics that it takes and sends.
struct CaretStep {
  std::string node, subscribed, published;
};
struct CaretPath {
  std::string name;
  std::vector<CaretStep> steps;
};
struct CaretArchitecture {
  std::vector<CaretNode> nodes;
  std::vector<CaretExecutor> executors;
  std::vector<CaretPath> paths;
  std::size_t services = 0;  ///< Callbacks of other kinds, which are left out.
};

/// Throws InputError with file and line.
[[nodiscard]] CaretArchitecture read_caret_architecture(const std::string& file);

/// CARET's measurements of one callback.
struct CaretStats {
  std::optional<Duration> period;       ///< Mean time between starts; none: it did not run.
  std::vector<DurationQuantile> times;  ///< Start to end, preemption included; none: it did not run.
};

/// Reads stats_node files (*.yaml) of a folder, by callback. Throws InputError with file and line.
[[nodiscard]] std::map<std::string, CaretStats> read_caret_stats(const std::string& folder);

}  // namespace hotpath::imports
