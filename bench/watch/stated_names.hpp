// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/reference_system/ros_names.hpp"
#include "hotpath/tracing/system.hpp"
#include "program/text.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

inline std::string node_name(const tracing::System& system, std::uint32_t node) {
  return node < system.nodes.size() ? system.nodes[node] : "(unknown node)";
}

/// `/node (timer 100 ms)`, `/node /topic` or `/node /name (service)`.
inline std::string callback_name(const tracing::System& system, const tracing::Callback& callback) {
  using tracing::CallbackKind;
  const std::string node = node_name(system, callback.node);
  if (callback.kind == CallbackKind::timer)
    return program::concat(node, " (timer ", to_ms(callback.period), " ms)");
  const bool service = callback.kind == CallbackKind::service;
  if (!service && callback.kind != CallbackKind::subscription) return "(unknown callback)";
  const bool named = callback.topic < system.topics.size();
  return node + (named ? " " + system.topics[callback.topic].name : "") + (service ? " (service)" : "");
}

/// Finds the nodes and topics of a contract in a running system, whose nodes may all be in one
/// further namespace, as in `/robot1/filter` and `/robot1/points` for `filter` and `points`.
class StatedNames {
 public:
  explicit StatedNames(const Contract& contract) {
    for (const CallbackContract& callback : contract.callbacks) {
      nodes_.insert(callback.node);
      for (const StatedPublication& p : callback.publishes)
        if (numbers_.try_emplace(p.topic, static_cast<std::uint32_t>(topics_.size())).second)
          topics_.push_back(p.topic);
    }
  }

  /// Whether any node of the contract runs. The namespace in which most of them run is used.
  bool resolve(const tracing::System& system) {
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
  /// A callback of the contract has run: the namespace stays.
  void keep() { kept_ = true; }
  [[nodiscard]] bool kept() const { return kept_; }
  /// Counts the changes of the namespace.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }

  /// The graph's name of a node, without the namespace; with a leading slash if it is in another one.
  [[nodiscard]] std::string node(const tracing::System& system, std::uint32_t node) const {
    const std::string& name = system.nodes[node];
    return is_inside(name) ? graph_node_name(name.substr(space_->size())) : name;
  }
  /// The same for a topic.
  [[nodiscard]] std::string topic(const tracing::System& system, std::uint32_t topic) const {
    const std::string& name = system.topics[topic].name;
    return is_inside(name) ? graph_topic_name(name.substr(space_->size())) : name;
  }

  /// Topics that callbacks of the contract publish.
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }
  /// Its index in topics(); kNone: no callback of the contract publishes it.
  [[nodiscard]] std::uint32_t number_of(const std::string& topic) const {
    const auto at = numbers_.find(topic);
    return at == numbers_.end() ? tracing::kNone : at->second;
  }
  /// The same for a topic of the running system; kNone also before resolve().
  [[nodiscard]] std::uint32_t number_of(const tracing::System& system, std::uint32_t topic) {
    if (topic >= system.topics.size() || !resolve(system)) return tracing::kNone;
    for (auto t = static_cast<std::uint32_t>(of_system_.size()); t < system.topics.size(); ++t)
      of_system_.push_back(number_of(this->topic(system, t)));
    return of_system_[topic];
  }

 private:
  [[nodiscard]] bool is_inside(const std::string& name) const {
    return space_ && name.starts_with(*space_ + "/");
  }

  std::set<std::string> nodes_;
  std::vector<std::string> topics_;
  std::map<std::string, std::uint32_t> numbers_;
  std::optional<std::string> space_;  // `/robot1`; empty: none
  std::size_t resolved_ = 0;          // nodes of the system
  std::uint64_t changes_ = 0;
  bool kept_ = false;
  std::vector<std::uint32_t> of_system_;  // by topic of the system
};

}  // namespace hotpath::watch
