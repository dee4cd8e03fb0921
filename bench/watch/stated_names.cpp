// SPDX-License-Identifier: Apache-2.0
#include "watch/stated_names.hpp"

#include <algorithm>
#include <utility>

#include "hotpath/reference_system/ros_names.hpp"

namespace hotpath::watch {

using tracing::kNone;

StatedNames::StatedNames(const Contract& contract) {
  for (const CallbackContract& callback : contract.callbacks) {
    nodes_.insert(callback.node);
    for (const StatedPublication& p : callback.publishes)
      if (numbers_.try_emplace(p.topic, static_cast<std::uint32_t>(topics_.size())).second)
        topics_.push_back(p.topic);
  }
}

bool StatedNames::resolve(const tracing::System& system) {
  if (kept_ || std::exchange(resolved_, system.nodes.size()) == system.nodes.size())
    return space_.has_value();
  std::map<std::string, std::uint32_t> matches;  // by namespace
  for (const std::string& name : system.nodes) {
    for (std::size_t at = 0; at != std::string::npos && at < name.size(); at = name.find('/', at + 1))
      if (nodes_.contains(graph_node_name(name.substr(at)))) ++matches[name.substr(0, at)];
  }
  const auto most = std::ranges::max_element(matches, {}, [](const auto& m) { return m.second; });
  if (most == matches.end() || space_ == most->first) return space_.has_value();
  space_ = most->first;
  ++changes_;
  of_system_.clear();
  return true;
}

std::string StatedNames::node(const tracing::System& system, std::uint32_t node) const {
  const std::string& name = system.nodes[node];
  return space_ && name.starts_with(*space_ + "/") ? graph_node_name(name.substr(space_->size())) : name;
}

std::string StatedNames::topic(const tracing::System& system, std::uint32_t topic) const {
  const std::string& name = system.topics[topic].name;
  return space_ && name.starts_with(*space_ + "/") ? graph_topic_name(name.substr(space_->size())) : name;
}

std::string StatedNames::imported(const std::string& node) const {
  return (space_ && !space_->empty() ? graph_node_name(*space_) + "." : "") + node;
}

std::uint32_t StatedNames::number_of(const std::string& topic) const {
  const auto at = numbers_.find(topic);
  return at == numbers_.end() ? kNone : at->second;
}

std::uint32_t StatedNames::number_of(const tracing::System& system, std::uint32_t topic) {
  if (topic >= system.topics.size() || !resolve(system)) return kNone;
  for (auto t = static_cast<std::uint32_t>(of_system_.size()); t < system.topics.size(); ++t)
    of_system_.push_back(number_of(this->topic(system, t)));
  return of_system_[topic];
}

}  // namespace hotpath::watch
