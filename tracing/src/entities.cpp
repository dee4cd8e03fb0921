// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

namespace {

/// 11 days. A timer of a longer period is never due, or its event is damaged.
constexpr Duration kLongestPeriod = std::chrono::milliseconds(999'999'999);

}  // namespace

void Assembler::on_rcl_init(const Event& e) { system_.rcl_version = e.text[0]; }

void Assembler::on_rmw_publisher_init(const Event& e) {
  endpoint(e, Endpoint::Kind::publisher, e.number[0]).id = {e.number[1], e.number[2]};
}

void Assembler::on_rmw_subscription_init(const Event& e) {
  endpoint(e, Endpoint::Kind::subscription, e.number[0]).id = {e.number[1], e.number[2]};
}

void Assembler::on_service_init(const Event& e) {
  endpoint(e, Endpoint::Kind::service, 0);
  if (*e.text[0] == '\0') return;
  services_[{e.process, e.number[0]}] = {find(nodes_, {e.process, e.number[1]}, kNone),
                                         topic_named(e.text[0], true)};
}

void Assembler::on_subscription_callback_added(const Event& e) {
  const Handle rclcpp{e.process, e.number[0]};
  rclcpp_callbacks_[rclcpp] = e.number[1];
  if (const auto s = find(rclcpp_subscriptions_, rclcpp, kNone); s != kNone)
    set_handle({e.process, e.number[1]}, s);
}

void Assembler::on_callback_register(const Event& e) {
  if (const std::uint32_t callback = find(callbacks_, {e.process, e.number[0]}, kNone); callback != kNone)
    system_.callbacks[callback].symbol = e.text[0];
}

void Assembler::on_buffer_to_ipb(const Event& e) { ipb_of_buffer_[{e.process, e.number[0]}] = e.number[1]; }

void Assembler::on_ipb_to_subscription(const Event& e) {
  subscription_of_ipb_[{e.process, e.number[0]}] = e.number[1];
}

void Assembler::on_node_init(const Event& e) {
  std::string name = e.text[1];
  if (!name.ends_with('/')) name += '/';
  nodes_[{e.process, e.number[0]}] = static_cast<std::uint32_t>(system_.nodes.size());
  system_.nodes.push_back(name + e.text[0]);
  system_.processes.insert(e.process);
}

void Assembler::on_publisher_init(const Event& e) {
  Endpoint& publisher = endpoint(e, Endpoint::Kind::publisher, e.number[2]);
  publisher.topic = topic_named(e.text[0]);
  publisher.node = find(nodes_, {e.process, e.number[1]}, kNone);
  publishers_[{e.process, e.number[0]}] = static_cast<std::uint32_t>(&publisher - system_.endpoints.data());
  endpoints_.erase({e.process, e.number[2]});
}

void Assembler::on_subscription_init(const Event& e) {
  const std::uint32_t index = add_callback(CallbackKind::subscription);
  Callback& callback = system_.callbacks[index];
  callback.node = find(nodes_, {e.process, e.number[1]}, kNone);
  callback.topic = topic_named(e.text[0]);
  callback.depth = static_cast<std::uint32_t>(std::min<std::uint64_t>(e.number[3], kKeepAll));
  callback.of_action = true;  // until rclcpp adds a callback
  callback_states_[index].process = e.process;
  if (bounded()) replace_subscriptions(e, callback);
  system_.topics[callback.topic].subscriptions.push_back(index);
  Endpoint& reader = endpoint(e, Endpoint::Kind::subscription, e.number[2]);
  reader.topic = callback.topic;
  reader.callback = index;
  endpoints_.erase({e.process, e.number[2]});
  subscriptions_[{e.process, e.number[0]}] = index;
  rmw_subscriptions_[{e.process, e.number[2]}] = index;
}

void Assembler::replace_subscriptions(const Event& e, const Callback& by) {
  for (const std::uint32_t older : {find(subscriptions_, {e.process, e.number[0]}, kNone),
                                    find(rmw_subscriptions_, {e.process, e.number[2]}, kNone)})
    if (older != kNone)
      end_subscriptions(system_.topics[system_.callbacks[older].topic],
                        [older](std::uint32_t subscription) { return subscription == older; });
  for (const std::uint32_t older : system_.topics[by.topic].subscriptions)
    if (by.node != kNone && system_.callbacks[older].node == by.node) callback_states_[older].doubtful = true;
}

template <class Ended>
void Assembler::end_subscriptions(Topic& topic, const Ended& ended) {
  std::erase_if(topic.subscriptions, [&](std::uint32_t subscription) {
    if (!ended(subscription)) return false;
    callback_states_[subscription].unread.clear();
    return true;
  });
}

/// rclcpp adds the callback of an intra-process subscription first, and then says whose it is.
void Assembler::on_rclcpp_subscription_init(const Event& e) {
  const Handle rclcpp{e.process, e.number[1]};
  const std::uint32_t subscription = find(subscriptions_, {e.process, e.number[0]}, kNone);
  rclcpp_subscriptions_[rclcpp] = subscription;
  if (subscription == kNone) return;
  system_.callbacks[subscription].of_action = false;
  const std::uint64_t callback = find(rclcpp_callbacks_, rclcpp, std::uint64_t{0});
  if (callback != 0) set_handle({e.process, callback}, subscription);
}

Endpoint& Assembler::endpoint(const Event& e, Endpoint::Kind kind, std::uint64_t rmw_handle) {
  const auto index = static_cast<std::uint32_t>(system_.endpoints.size());
  if (rmw_handle != 0) {
    const auto [at, is_new] = endpoints_.try_emplace({e.process, rmw_handle}, index);
    if (!is_new) return system_.endpoints[at->second];
  }
  Endpoint& added = system_.endpoints.emplace_back();
  added.kind = kind;
  added.process = e.process;
  return added;
}

void Assembler::on_timer_init(const Event& e) {
  Timer& timer = timers_[{e.process, e.number[0]}];
  if (bounded() && timer.callback != kNone)  // whose address is free again
    ended_timers_[{system_.callbacks[timer.callback].node, timer.period}].push_back(timer.callback);
  timer = {Duration(static_cast<std::int64_t>(e.number[1])), e.at, 0, kNone};
}

void Assembler::on_timer_callback_added(const Event& e) {
  Timer& timer = timers_[{e.process, e.number[0]}];
  if (timer.period <= Duration::zero() || timer.period > kLongestPeriod) return;
  timer.address = e.number[1];
  if (!bounded()) begin_timer({e.process, timer.address}, timer, add_callback(CallbackKind::timer));
}

void Assembler::begin_timer(Handle callback, Timer& timer, std::uint32_t index) {
  timer.callback = index;
  system_.callbacks[index].period = timer.period;
  system_.callbacks[index].created = timer.created;
  set_handle(callback, index);
}

/// A node may create timers for ever, as tf2's MessageFilter does for each message that waits. One
/// that follows another of its node and period is the same callback, or else memory would grow.
void Assembler::on_timer_link_node(const Event& e) {
  const auto at = timers_.find({e.process, e.number[0]});
  if (at == timers_.end()) return;
  Timer& timer = at->second;
  const std::uint32_t node = find(nodes_, {e.process, e.number[1]}, kNone);
  if (bounded() && timer.callback == kNone && timer.address != 0) {
    std::vector<std::uint32_t>& ended = ended_timers_[{node, timer.period}];
    if (ended.empty()) ended.push_back(add_callback(CallbackKind::timer));
    begin_timer({e.process, timer.address}, timer, ended.back());
    ended.pop_back();
  }
  if (timer.callback != kNone) system_.callbacks[timer.callback].node = node;
}

void Assembler::on_service_callback_added(const Event& e) {
  const std::uint32_t index = add_callback(CallbackKind::service);
  const Service service = find(services_, {e.process, e.number[0]}, {});
  system_.callbacks[index].node = service.node;
  system_.callbacks[index].topic = service.topic;
  system_.callbacks[index].depth = kServiceDepth;
  set_handle({e.process, e.number[1]}, index);
  service_callbacks_[{e.process, e.number[0]}] = index;
}

std::uint32_t Assembler::add_callback(CallbackKind kind) {
  system_.callbacks.emplace_back().kind = kind;
  callback_states_.emplace_back();
  return static_cast<std::uint32_t>(system_.callbacks.size() - 1);
}

/// Jobs at this address belong to the callback from now on.
void Assembler::set_handle(Handle handle, std::uint32_t callback) {
  const auto [at, is_new] = callbacks_.try_emplace(handle, callback);
  if (is_new || at->second == callback) return;
  at->second = callback;
  ++system_.reused_handles;
}

std::uint32_t Assembler::topic_named(const std::string& name, bool of_service) {
  const auto [at, is_new] =
      topics_.try_emplace({of_service, name}, static_cast<std::uint32_t>(system_.topics.size()));
  if (is_new) system_.topics.emplace_back().name = name;
  return at->second;
}

Assembler::ThreadState& Assembler::thread_of(const Event& e) {
  const auto [at, is_new] = thread_indices_.try_emplace(Handle{e.process, e.thread}, kNone);
  if (is_new) {
    if (free_threads_.empty()) {
      free_threads_.push_back(static_cast<std::uint32_t>(threads_.size()));
      threads_.emplace_back();
      system_.threads.emplace_back();
    }
    at->second = free_threads_.back();
    free_threads_.pop_back();
    threads_[at->second].index = at->second;
    system_.threads[at->second] = {e.process, e.thread, 0, 0, {}};
  }
  return threads_[at->second];
}

void Assembler::forget_thread(std::uint32_t process, std::uint32_t thread) {
  const auto at = thread_indices_.find(Handle{process, thread});
  if (at == thread_indices_.end() || !threads_[at->second].open.empty()) return;
  if (system_.threads[at->second].waits > 0) --waiting_threads_[process];
  threads_[at->second] = {};
  for (ThreadState& other : threads_) other.apart.erase(at->second);
  system_.threads[at->second] = {};
  free_threads_.push_back(at->second);
  thread_indices_.erase(at);
}

void Assembler::forget_process(std::uint32_t process) {
  for (std::size_t t = 0; t < threads_.size(); ++t) {
    if (system_.threads[t].process != process) continue;
    give_up(threads_[t].open, 0);
    forget_thread(process, system_.threads[t].id);
  }
  const auto of_process = [&](std::uint32_t s) { return callback_states_[s].process == process; };
  for (Topic& topic : system_.topics) end_subscriptions(topic, of_process);
  for (auto& [service, clients] : clients_of_)
    std::erase_if(clients, [&](std::uint32_t client) { return system_.clients[client].process == process; });
  const auto is_known = [&](const auto& known) { return known.first.process == process; };
  std::apply([&](auto&... known) { (std::erase_if(known, is_known), ...); }, by_address());
  waiting_threads_.erase(process);
  responses_.erase(process);
  system_.ended_processes += system_.processes.erase(process);
}

/// Whether there is no room for further entities.
bool Assembler::full() {
  if (!bounded()) return false;
  const std::size_t addresses =
      std::apply([](const auto&... known) { return (known.size() + ...); }, by_address());
  return addresses >= kMostAddresses || system_.nodes.size() + system_.callbacks.size() +
                                                system_.endpoints.size() + system_.stated_executors.size() >=
                                            most_entities_;
}

}  // namespace hotpath::tracing
