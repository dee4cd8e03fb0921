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
    tracing::Event event;
    event.kind = kind;
    event.process = event.thread = 7;
    event.processor = 1;
    event.at = at_ms(ms);
    event.number = numbers;
    event.text = texts;
    events.push_back(event);
  }

  WatchedSystem() {
    add(K::node_init, 0, {1, 3}, {"source", "/"});
    add(K::publisher_init, 0, {13, 1, 14, 1}, {"/a", ""});
    create_timer(0);
    add(K::node_init, 0, {2, 4}, {"sink", "/space"});
    add(K::subscription_init, 0, {20, 2, 23, 2}, {"/a", ""});
    add(K::rclcpp_subscription_init, 0, {20, 22});
    add(K::subscription_callback_added, 0, {22, 21});
  }

  /// Also again, after the timer has ended.
  void create_timer(double ms) {
    add(K::timer_init, ms, {10, 10'000'000});
    add(K::timer_callback_added, ms, {10, 11});
    add(K::timer_link_node, ms, {10, 1});
  }

  /// A job of the timer, which publishes at its end, and of the subscription directly after it.
  void run(double start_ms, double length_ms, bool taken = true) {
    ++stamp;
    add(K::callback_start, start_ms, {11});
    add(K::rcl_publish, start_ms + length_ms, {13, 99});
    add(K::rmw_publish, start_ms + length_ms, {14, 99, stamp});
    add(K::callback_end, start_ms + length_ms, {11});
    if (!taken) return;
    add(K::rmw_take, start_ms + length_ms, {23, 98, stamp, 1});
    add(K::callback_start, start_ms + length_ms, {21});
    add(K::callback_end, start_ms + length_ms + 1, {21});
  }

  std::vector<tracing::Event> events;
  std::uint64_t stamp = 0;
};

}  // namespace hotpath::watch
