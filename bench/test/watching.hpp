// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "watch/observer.hpp"

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

/// A chain from the timer to the subscription, and the thread that runs both.
inline constexpr const char* kContract = R"(
callbacks:
- node: source
  budget_ms: {value: 2, from: measured}
  period_ms: {value: 10, from: given}
  maximum_distance_ms: {value: 13, from: derived}
  publishes: [{topic: a}]
- node: space.sink
  topic: a
  budget_ms: {value: 1, from: measured}
  minimum_distance_ms: {value: [7, 17], from: derived}
  lost: {value: 0, from: derived}
  publishes: []
chains:
- name: path
  sources: [source (timer)]
  sinks: [space.sink/a]
  hot_path_ms: {value: 2.5, from: derived}
  age_ms: {value: 4, from: derived}
  requirement_ms: {value: 3.5, from: given}
threads:
- name: main
  callbacks: [source (timer), space.sink/a]
  policy: {value: "fifo:80", from: given}
  processors: {value: [1, 2], from: given}
  wait_ms: {value: 1, from: given}
)";

/// Events of a watched system, checked against a contract.
class Watching : public testing::Test {
 public:
  explicit Watching(const std::string& contract = kContract)
      : observer(parse_contract("a contract", contract), nullptr) {}
  static void SetUpTestSuite() {
    setenv("TZ", "UTC", 1);
    tzset();
  }
  void observe() {
    for (; observed < system.events.size(); ++observed) observer.event(system.events[observed]);
  }
  void until(double ms) {
    observe();
    observer.observed_until(at_ms(ms), losses);
  }
  /// Of a callback, chain, thread or topic.
  nlohmann::json term(const std::string& of, const std::string& term, bool lossy = false) {
    const nlohmann::json stored = observer.judge().json(lossy);
    for (const nlohmann::json& t : stored["terms"])
      for (const char* kind : {"callback", "chain", "thread", "topic"})
        if (t.value(kind, "") == of && t["term"] == term) return t;
    return {{"verdict", "no such term"}};
  }
  std::string verdict(const std::string& of, const std::string& name, bool lossy = false) {
    return term(of, name, lossy)["verdict"];
  }
  /// What broke first; empty: nothing.
  std::string incident() { return observer.judge().incident(); }
  const std::deque<Incident>& incidents() { return observer.judge().incidents().kept; }
  /// The other facts of the latest incident.
  std::vector<std::string> others() {
    observer.describe(true);
    return incidents().back().facts();
  }
  ThreadFacts facts() const {
    ThreadFacts f{.process = 7, .thread = 7, .name = "spin"};
    f.policy = parse_thread_policy("fifo:80");
    f.processors = {1, 2};
    return f;
  }

  WatchedSystem system;
  Observer observer;
  std::size_t observed = 0;
  std::uint64_t losses = 0;
};

}  // namespace hotpath::watch
