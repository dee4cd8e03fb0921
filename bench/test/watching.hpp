// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "watch/observer.hpp"
#include "watched_system.hpp"

namespace hotpath::watch {

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
 protected:
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
  std::string incident() const { return observer.judge().incident(); }
  const std::deque<Incident>& incidents() { return observer.judge().incidents().kept(); }
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
