// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/reference_node.hpp"

#include <numeric>

namespace hotpath {

namespace {

/// The publications of jobs of an input, or of the timer.
std::vector<Publication> publications_of(const ReferenceNode& node, std::optional<std::uint32_t> input) {
  const bool silent = node.type == NodeType::command || (node.type == NodeType::cyclic && input);
  if (silent || node.outputs.empty()) return {};
  Publication publication;
  publication.topic = node.type == NodeType::intersection ? node.outputs.at(*input) : node.outputs.front();
  if (node.type == NodeType::fusion || node.type == NodeType::cyclic) {
    publication.rule = node.type == NodeType::fusion ? PublishRule::all_new : PublishRule::last_of;
    publication.of.resize(node.inputs.size());
    std::iota(publication.of.begin(), publication.of.end(), 0U);
  }
  return {publication};
}

std::vector<Callback> expanded(const ReferenceNode& node) {
  std::vector<Callback> callbacks;
  for (std::uint32_t i = 0; i < node.inputs.size(); ++i) {
    Callback& subscription = callbacks.emplace_back();
    subscription.task = node.name + "/" + node.inputs[i].topic;
    subscription.input = i;
    subscription.priority = node.inputs[i].priority;
  }
  if (node.type == NodeType::sensor || node.type == NodeType::cyclic) {
    Callback& timer = callbacks.emplace_back();
    static_cast<StatedTimer&>(timer) = node;
    timer.task = node.name;
    if (timer.deadline == Duration::zero()) timer.deadline = timer.period;
  }
  for (Callback& callback : callbacks) {
    callback.publishes = publications_of(node, callback.input);
    if (node.type == NodeType::cyclic && callback.input) continue;  // only stores
    callback.worst = node.execution_time;
    callback.best = node.best_case_execution_time;
  }
  return callbacks;
}

}  // namespace

ReferenceNode::operator Node() const {
  return {name, type, {inputs.begin(), inputs.end()}, outputs, {group}, {}, expanded(*this)};
}

}  // namespace hotpath
