// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// An input of a ReferenceNode.
struct ReferenceInput {
  std::string topic;
  std::uint32_t depth = 1;               ///< As Input::depth.
  std::optional<std::int64_t> priority;  ///< Given fixed priority of the subscription.

  operator Input() const { return {topic, depth}; }  // NOLINT(google-explicit-constructor)
};

/// A node of one of the six types of the reference system, in the short form of files. The comments name
/// the types to which a member applies. The timer is that of sensor and cyclic; a deadline of 0 is the
/// period.
struct ReferenceNode : StatedTimer {
  std::string name;
  NodeType type = NodeType::sensor;
  std::vector<ReferenceInput> inputs;
  std::vector<std::string> outputs;  ///< intersection: one per input; command: none; other types: one.
  Duration execution_time{};         ///< Work of one activation (worst case).
  Duration best_case_execution_time{};
  CallbackGroup group = CallbackGroup::mutually_exclusive;  ///< Of all callbacks.

  /// The node with its callbacks: subscriptions in input order, then the timer.
  operator Node() const;  // NOLINT(google-explicit-constructor): a node wherever a graph takes one
};

}  // namespace hotpath
