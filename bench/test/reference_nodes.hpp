// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

/// A node that publishes a topic of its name, unless it is a command; `period`: of its timer.
inline ReferenceNode reference_node(const std::string& name, NodeType type,
                                    std::vector<ReferenceInput> inputs = {}, Duration period = {},
                                    Duration execution_time = {}) {
  ReferenceNode node;
  node.name = name;
  node.type = type;
  node.inputs = std::move(inputs);
  node.period = node.deadline = period;
  node.execution_time = node.best_case_execution_time = execution_time;
  if (type != NodeType::command) node.outputs = {name};
  return node;
}

}  // namespace hotpath
