// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/tracing/event.hpp"

namespace hotpath::watch {

inline tracing::Time at_ms(double ms) { return Time{} + from_ms(ms); }

/// The events of a node /source, whose timer (10 ms, created at 0) publishes /a, and of a node
/// /space/sink that takes it.
struct WatchedSystem {
  using K = tracing::EventKind;

  void add(K kind, double ms, std::array<std::uint64_t, 4> numbers,
           std::array<const char*, 2> texts = {"", ""}) {
    events.push_back({kind, 7, 7, 1, at_ms(ms), numbers, texts});
  }

  WatchedSystem() {
    add(K::node_init, 0, {1, 3}, {"source", "/"});
    add(K::publisher_init, 0, {13, 1, 14, 1}, {"/a", ""});
    create_timer(0);
    add(K::node_init, 0, {2, 4}, {"sink", "/space"});
    create_subscription(0, 20, 2, "/a");
  }

  /// Its callback is the next handle. Also again, after the timer has ended.
  void create_timer(double ms, std::uint64_t timer = 10, std::uint64_t period_ns = 10'000'000,
                    std::uint64_t node = 1) {
    add(K::timer_init, ms, {timer, period_ns});
    add(K::timer_callback_added, ms, {timer, timer + 1});
    add(K::timer_link_node, ms, {timer, node});
  }
  /// Its callback is the next handle, that of the middleware the third next.
  void create_subscription(double ms, std::uint64_t handle, std::uint64_t node, const char* topic) {
    add(K::subscription_init, ms, {handle, node, handle + 3, 2}, {topic, ""});
    add(K::rclcpp_subscription_init, ms, {handle, handle + 2});
    add(K::subscription_callback_added, ms, {handle + 2, handle + 1});
  }
  void create_service(double ms, std::uint64_t handle, std::uint64_t node, const char* name) {
    add(K::service_init, ms, {handle, node}, {name, ""});
    add(K::service_callback_added, ms, {handle, handle + 1});
  }

  void job(double start_ms, double length_ms, std::uint64_t callback) {
    add(K::callback_start, start_ms, {callback});
    add(K::callback_end, start_ms + length_ms, {callback});
  }
  /// A job of a subscription, by the handle of its callback.
  void take(double ms, std::uint64_t published, double length_ms = 1, std::uint64_t callback = 21) {
    add(K::rmw_take, ms, {callback + 2, 98, published, 1});
    job(ms, length_ms, callback);
  }

  /// A job of the timer, which publishes at its end, and of the subscription directly after it.
  void run(double start_ms, double length_ms, bool taken = true) {
    ++stamp;
    add(K::callback_start, start_ms, {11});
    add(K::rcl_publish, start_ms + length_ms, {13, 99});
    add(K::rmw_publish, start_ms + length_ms, {14, 99, stamp});
    add(K::callback_end, start_ms + length_ms, {11});
    if (taken) take(start_ms + length_ms, stamp);
  }

  std::vector<tracing::Event> events;
  std::uint64_t stamp = 0;
};

}  // namespace hotpath::watch
