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

[[nodiscard]] inline std::string node_name(const tracing::System& system, std::uint32_t node) {
  return node < system.nodes.size() ? system.nodes[node] : "(unknown node)";
}

/// `/node (timer 100 ms)`, `/node /topic` or `/node /name (service)`.
[[nodiscard]] inline std::string callback_name(const tracing::System& system,
                                               const tracing::Callback& callback) {
  using tracing::CallbackKind;
  const std::string node = node_name(system, callback.node);
  if (callback.kind == CallbackKind::timer)
    return program::concat(node, " (timer ", to_ms(callback.period), " ms)");
  const bool service = callback.kind == CallbackKind::service;
  if (!service && callback.kind != CallbackKind::subscription) return "(unknown callback)";
  const bool named = callback.topic < system.topics.size();
  return node + (named ? " " + system.topics[callback.topic].name : "") + (service ? " (service)" : "");
}

/// Finds the callbacks and topics of a contract in a running system, whose nodes may all be in one
/// further namespace, as in `/robot1/filter` and `/robot1/points` for `filter` and `points`. Until a
/// callback of the contract has run, that is the namespace in which most of the nodes are.
class StatedNames {
 public:
  /// Both must outlive it.
  StatedNames(const Contract& of, const tracing::System& running)
      : contract(of), system(running), latest_(of.callbacks.size()) {
    for (const CallbackContract& callback : contract.callbacks) {
      nodes_.insert(callback.node);
      for (const StatedPublication& p : callback.publishes)
        if (number_of(p.topic) == kNone) topics_.push_back(p.topic);
    }
  }

  /// Index of the contract's entry for a callback of the system; kNone: none.
  [[nodiscard]] std::uint32_t entry_of(std::uint32_t callback) {
    if (callback >= entries_.size()) entries_.resize(callback + 1);
    if (!resolve()) return kNone;
    if (!entries_[callback]) entries_[callback] = find_entry(callback);
    kept_ = kept_ || *entries_[callback] != kNone;
    return *entries_[callback];
  }
  /// A job of the entry, a timer, started.
  void timer_ran(std::uint32_t entry, Time start) { latest_[entry] = start; }
  /// Whether a callback of the contract has run.
  [[nodiscard]] bool kept() const { return kept_; }

  /// The graph's name, without the namespace; with a leading slash if the node is in another one.
  [[nodiscard]] std::string stated_node(std::uint32_t node) const {
    const std::string& name = system.nodes[node];
    return is_inside(name) ? graph_node_name(name.substr(space_->size())) : name;
  }
  /// Topics that callbacks of the contract publish.
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }
  /// Its index in topics(); kNone: no callback of the contract publishes it.
  [[nodiscard]] std::uint32_t number_of(const std::string& topic) const {
    const auto at = std::ranges::find(topics_, topic);
    return at == topics_.end() ? kNone : static_cast<std::uint32_t>(at - topics_.begin());
  }
  /// The same for a topic of the running system.
  [[nodiscard]] std::uint32_t number_of(std::uint32_t topic) {
    if (topic >= system.topics.size() || !resolve()) return kNone;
    for (auto t = static_cast<std::uint32_t>(of_system_.size()); t < system.topics.size(); ++t)
      of_system_.push_back(number_of(stated_topic(t)));
    return of_system_[topic];
  }
  /// Whether the contract lets the node of the running system publish the topic of this number.
  [[nodiscard]] bool may_publish(std::uint32_t node, std::uint32_t number) const {
    return node < system.nodes.size() &&
           std::ranges::any_of(contract.callbacks, [&](const CallbackContract& callback) {
             return callback.node == stated_node(node) && callback.publication(topics_[number]);
           });
  }

  const Contract& contract;
  const tracing::System& system;

 private:
  static constexpr std::uint32_t kNone = tracing::kNone;
  using CallbackKind = tracing::CallbackKind;

  /// Whether any node of the contract runs.
  bool resolve() {
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
    of_system_.clear();
    std::ranges::fill(entries_, std::nullopt);
    return true;
  }
  [[nodiscard]] bool is_inside(const std::string& name) const {
    return space_ && name.starts_with(*space_ + "/");
  }
  [[nodiscard]] std::string stated_topic(std::uint32_t topic) const {
    const std::string& name = system.topics[topic].name;
    return is_inside(name) ? graph_topic_name(name.substr(space_->size())) : name;
  }
  [[nodiscard]] std::uint32_t find_entry(std::uint32_t callback) const {
    const tracing::Callback& of = system.callbacks[callback];
    const bool service = of.kind == CallbackKind::service;
    if (of.node >= system.nodes.size()) return kNone;
    const std::string node = stated_node(of.node);
    if (of.kind == CallbackKind::timer) return timer_entry(node, callback);
    if ((!service && of.kind != CallbackKind::subscription) || of.topic >= system.topics.size()) return kNone;
    const std::string topic = stated_topic(of.topic);
    const auto entry_for = [&](bool a_service) {
      const auto entry = std::ranges::find_if(contract.callbacks, [&](const CallbackContract& stated) {
        return stated.node == node && stated.topic == topic && stated.service == a_service;
      });
      const bool found = entry != contract.callbacks.end();
      return found ? static_cast<std::uint32_t>(entry - contract.callbacks.begin()) : kNone;
    };
    const std::uint32_t entry = entry_for(service);
    if (entry != kNone || service) return entry;
    // Without ROS 2, subscriptions stand for the services of a graph.
    const bool is_service = std::ranges::any_of(system.callbacks, [&](const tracing::Callback& c) {
      return c.kind == CallbackKind::service && c.node == of.node && c.topic < system.topics.size() &&
             system.topics[c.topic].name == system.topics[of.topic].name;
    });
    return is_service ? kNone : entry_for(true);
  }
  /// The entry of the timer's number. A contract of a recording numbers timers as the executor served them:
  /// another entry that has the period, and belongs to no timer by the order of creation, is its own. Beyond
  /// the stated timers, it replaces one: of those with its period that ran before its creation, and not
  /// since, the one that has been silent longest. kNone: there is none.
  [[nodiscard]] std::uint32_t timer_entry(const std::string& node, std::uint32_t callback) const {
    const tracing::Callback& of = system.callbacks[callback];
    std::vector<Duration> periods;  // of the node's timers
    std::uint32_t number = 0, own = kNone, another = kNone, replaced = kNone;
    for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
      const tracing::Callback& other = system.callbacks[c];
      if (other.kind != CallbackKind::timer || other.node != of.node) continue;
      periods.push_back(other.period);
      if (c == callback) number = static_cast<std::uint32_t>(periods.size());
    }
    bool beyond = true;
    for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
      const CallbackContract& stated = contract.callbacks[c];
      if (stated.node != node || !stated.topic.empty()) continue;
      beyond = beyond && stated.timer < number;
      if (stated.timer == number) own = c;
      const Term* const period = find(stated.terms, Clause::period);
      if (!period || period->limit != of.period.count()) continue;
      if (stated.timer == number) return c;
      if (stated.timer > periods.size() || periods[stated.timer - 1] != of.period) another = c;
      const std::optional<Time>& latest = latest_[c];
      if (latest && *latest < of.created && (replaced == kNone || *latest < *latest_[replaced])) replaced = c;
    }
    if (another == kNone && own == kNone) return beyond ? replaced : kNone;
    return another == kNone ? own : another;
  }

  std::set<std::string> nodes_;
  std::vector<std::string> topics_;
  std::optional<std::string> space_;  // `/robot1`; empty: none
  std::size_t resolved_ = 0;          // nodes of the system
  bool kept_ = false;
  std::vector<std::optional<std::uint32_t>> entries_;  // by callback of the system
  std::vector<std::uint32_t> of_system_;               // by topic of the system
  std::vector<std::optional<Time>> latest_;            // by entry: start of a timer's latest job
};

}  // namespace hotpath::watch
