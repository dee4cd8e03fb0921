// SPDX-License-Identifier: Apache-2.0
// The events of a trace that create nodes, topics and callbacks.
#include "import/trace_assembler.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

namespace {

/// The longest period that a graph file can hold; a timer with a longer one is not a task.
constexpr Duration kLongestPeriod = std::chrono::milliseconds(999'999'999);

}  // namespace

bool TraceAssembler::describe(const TraceEvent& e) {
  const Handle first{e.process, e.number[0]};
  using K = TraceEventKind;
  switch (e.kind) {
    case K::rcl_init:
      system_.rcl_version = e.text[0];
      return true;
    case K::node_init:
      node(e);
      return true;
    case K::publisher_init:
      publisher(e);
      return true;
    case K::subscription_init:
      subscription(e);
      return true;
    case K::rclcpp_subscription_init:
      rclcpp_subscriptions_[{e.process, e.number[1]}] = first;
      return true;
    case K::subscription_callback_added:
      subscription_callback(e);
      return true;
    case K::timer_init:
      timers_[first] = {Duration(static_cast<std::int64_t>(e.number[1])), from_ns(e.at_ns), kNone};
      return true;
    case K::timer_callback_added:
      timer_callback(e);
      return true;
    case K::timer_link_node:
      link(e);
      return true;
    case K::service_callback_added:
      system_.callbacks.emplace_back().kind = RecordedKind::service;
      add_callback({e.process, e.number[1]}, static_cast<std::uint32_t>(system_.callbacks.size() - 1));
      return true;
    case K::buffer_to_ipb:
      ipb_of_buffer_[first] = e.number[1];
      return true;
    case K::ipb_to_subscription:
      subscription_of_ipb_[first] = e.number[1];
      return true;
    default:
      return false;
  }
}

void TraceAssembler::node(const TraceEvent& e) {
  std::string name(e.text[1]);
  if (!name.ends_with('/')) name += '/';
  name += e.text[0];
  nodes_[{e.process, e.number[0]}] = static_cast<std::uint32_t>(system_.nodes.size());
  system_.nodes.emplace_back().name = std::move(name);
  system_.processes.insert(e.process);
}

void TraceAssembler::publisher(const TraceEvent& e) {
  publishers_[{e.process, e.number[0]}] = topic_named(e.text[0]);
}

void TraceAssembler::subscription(const TraceEvent& e) {
  const auto index = static_cast<std::uint32_t>(system_.callbacks.size());
  RecordedCallback& callback = system_.callbacks.emplace_back();
  callback.kind = RecordedKind::subscription;
  callback.node = node_of({e.process, e.number[1]});
  callback.topic = topic_named(e.text[0]);
  callback.depth = static_cast<std::uint32_t>(std::min<std::uint64_t>(e.number[3], kKeepAll));
  system_.topics[callback.topic].subscriptions.push_back(index);
  subscriptions_[{e.process, e.number[0]}] = index;
  rmw_subscriptions_[{e.process, e.number[2]}] = index;
}

void TraceAssembler::subscription_callback(const TraceEvent& e) {
  const auto rcl = rclcpp_subscriptions_.find({e.process, e.number[0]});
  if (rcl == rclcpp_subscriptions_.end()) return;
  const auto known = subscriptions_.find(rcl->second);
  if (known != subscriptions_.end()) add_callback({e.process, e.number[1]}, known->second);
}

void TraceAssembler::link(const TraceEvent& e) {
  const auto timer = timers_.find({e.process, e.number[0]});
  if (timer == timers_.end() || timer->second.callback == kNone) return;
  system_.callbacks[timer->second.callback].node = node_of({e.process, e.number[1]});
}

void TraceAssembler::timer_callback(const TraceEvent& e) {
  Timer& timer = timers_[{e.process, e.number[0]}];
  if (timer.period <= Duration::zero() || timer.period > kLongestPeriod) return;
  timer.callback = static_cast<std::uint32_t>(system_.callbacks.size());
  RecordedCallback& callback = system_.callbacks.emplace_back();
  callback.kind = RecordedKind::timer;
  callback.period = timer.period;
  callback.created = timer.created;
  add_callback({e.process, e.number[1]}, timer.callback);
}

void TraceAssembler::add_callback(Handle callback, std::uint32_t index) {
  const auto [at, is_new] = callbacks_.try_emplace(callback, index);
  if (is_new || at->second == index) return;
  at->second = index;
  ++system_.reused_handles;
}

std::uint32_t TraceAssembler::node_of(Handle handle) const {
  const auto node = nodes_.find(handle);
  return node == nodes_.end() ? kNone : node->second;
}

std::uint32_t TraceAssembler::topic_named(std::string_view name) {
  const auto [at, is_new] =
      topics_.try_emplace(std::string(name), static_cast<std::uint32_t>(system_.topics.size()));
  if (is_new) system_.topics.emplace_back().name = name;
  return at->second;
}

std::uint32_t TraceAssembler::subscription_behind(std::uint32_t process, std::uint64_t buffer) const {
  const auto ipb = ipb_of_buffer_.find({process, buffer});
  if (ipb == ipb_of_buffer_.end()) return kNone;
  const auto rclcpp = subscription_of_ipb_.find({process, ipb->second});
  if (rclcpp == subscription_of_ipb_.end()) return kNone;
  const auto rcl = rclcpp_subscriptions_.find({process, rclcpp->second});
  if (rcl == rclcpp_subscriptions_.end()) return kNone;
  const auto index = subscriptions_.find(rcl->second);
  return index == subscriptions_.end() ? kNone : index->second;
}

}  // namespace hotpath
