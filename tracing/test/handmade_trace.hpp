// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

using K = EventKind;

inline Time at(std::int64_t ns) { return Time{} + Duration(ns); }

/// Feeds a handmade trace to the assembler and keeps the results.
class Recording : public Sink {
 public:
  /// As of the assembler.
  explicit Recording(std::size_t most_entities = 0) : assembler(*this, most_entities) {}

  void tell(K kind, std::int64_t at_ns, std::array<std::uint64_t, 4> numbers,
            std::array<const char*, 2> texts = {"", ""}, std::uint32_t thread = 1) {
    assembler.event({kind, process, thread, 0, at(at_ns), numbers, texts});
  }

  /// Node 1 with a timer (callback 11) that publishes /a (publisher 13), and node 2 with a
  /// subscription to it (callback 21, rmw handle 23).
  void make_nodes(std::uint64_t depth = 1) {
    make_source();
    make_sink(depth);
  }

  void make_source() {
    tell(K::node_init, 0, {1, 3}, {"source", "/"});
    tell(K::publisher_init, 1, {13, 1, 14}, {"/a", ""});
    tell(K::timer_init, 2, {10, 1000});
    tell(K::timer_callback_added, 3, {10, 11});
    tell(K::timer_link_node, 4, {10, 1});
  }

  void make_sink(std::uint64_t depth) {
    tell(K::node_init, 5, {2, 4}, {"sink", "/space"});
    tell(K::subscription_init, 6, {20, 2, 23, depth}, {"/a", ""});
    tell(K::rclcpp_subscription_init, 7, {20, 22});
    tell(K::subscription_callback_added, 8, {22, 21});
  }

  /// A timer job that publishes with this source timestamp; 0: no timestamp, as in Humble.
  void publish(std::int64_t at_ns, std::uint64_t source_ns) {
    tell(K::callback_start, at_ns, {11});
    tell(K::rcl_publish, at_ns + 1, {13, 99});
    tell(K::rmw_publish, at_ns + 2, {14, 99, source_ns});
    tell(K::callback_end, at_ns + 3, {11});
  }

  void receive(std::int64_t at_ns, std::uint64_t source_ns) {
    tell(K::rmw_take, at_ns, {23, 98, source_ns, 1});
    tell(K::callback_start, at_ns + 1, {21});
    tell(K::callback_end, at_ns + 2, {21});
  }

  void ended(Job&& job) override { jobs.push_back(std::move(job)); }
  void lost(const LostSample& lost) override {
    (lost.queued ? unread : overwritten).push_back(lost.sample.sequence);
  }

  std::uint32_t process = 7;  ///< Of the next events.
  Assembler assembler;
  std::vector<Job> jobs;
  std::vector<std::uint64_t> overwritten, unread;
};

}  // namespace hotpath::tracing
