// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hotpath/reference_system/ros_names.hpp"
#include "hotpath/tracing/system.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

/// The topics that the callbacks of a contract publish, numbered from 0.
class StatedTopics {
 public:
  explicit StatedTopics(const Contract& contract) {
    for (const CallbackContract& callback : contract.callbacks)
      for (const StatedPublication& p : callback.publishes)
        numbers_.try_emplace(p.topic, static_cast<std::uint32_t>(numbers_.size()));
  }

  [[nodiscard]] std::size_t size() const { return numbers_.size(); }
  /// kNone: no callback of the contract publishes it.
  [[nodiscard]] std::uint32_t find(const std::string& name) const {
    const auto at = numbers_.find(name);
    return at == numbers_.end() ? tracing::kNone : at->second;
  }
  /// The same for a topic of a running system.
  [[nodiscard]] std::uint32_t of(const tracing::System& system, std::uint32_t topic) {
    if (topic >= system.topics.size()) return tracing::kNone;
    for (std::size_t t = of_system_.size(); t < system.topics.size(); ++t)
      of_system_.push_back(find(graph_topic_name(system.topics[t].name)));
    return of_system_[topic];
  }

 private:
  std::map<std::string, std::uint32_t> numbers_;
  std::vector<std::uint32_t> of_system_;  // by topic of the system
};

}  // namespace hotpath::watch
