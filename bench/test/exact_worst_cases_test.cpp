// SPDX-License-Identifier: Apache-2.0
// Chains whose data goes round in a circle, and the exact method's limits: publications before the end of
// jobs, and jitter under a timer thread that jobs wake up.
#include "bounds/bounds.hpp"

#include <gmock/gmock.h>

#include <utility>

#include "graph_fixture.hpp"
#include "program/text.hpp"

namespace hotpath::exact_worst_cases_test {

using testing::HasSubstr;

GraphBounds bounds_of(const std::string& nodes, const std::string& more = "",
                      const char* executor = "events-ro", const SchedulerOptions& options = {}) {
  const Graph graph = load("name: g\nnodes:\n" + nodes + more);
  return bounds::exact_worst_cases(graph, make_tasks(graph), *find_executor(executor), options);
}

/// The messages of A's timer return to it by way of B; D uses those of B and of S. E's data goes round.
TEST(ExactWorstCases, DataThatReturnsToItsChainDoesNotCount) {
  const GraphBounds bounds = bounds_of(
      "  - {name: S, type: sensor, period_ms: 10, execution_time_ms: 1}\n"
      "  - name: A\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: b}\n"
      "      - {subscription: E}\n"
      "      - {timer: t, period_ms: 10, execution_time_ms: 1, publishes: {topic: a, last_of: [b, E]}}\n"
      "  - name: B\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: a, execution_time_ms: 1, publishes: b}\n"
      "  - name: D\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: b}\n"
      "      - {subscription: S}\n"
      "      - {timer: u, period_ms: 10, execution_time_ms: 1, publishes: {topic: d, last_of: [b, S]}}\n"
      "  - {name: C, type: command, input: d, execution_time_ms: 1}\n"
      "  - {name: E, type: sensor, period_ms: 10, execution_time_ms: 1}\n",
      "chains:\n"
      "  - {name: behind, nodes: [S, D/S, D/u, C], sources: [S], sink: C}\n"
      "  - {name: circle, nodes: [A/t, B/a], sources: [A/t], sink: B/a}\n"
      "  - {name: into, nodes: [E, A/E, A/t, B/a], sources: [E], sink: B/a}\n");
  EXPECT_EQ(bounds.refusal, std::nullopt);
  ASSERT_EQ(bounds.chains.size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) ASSERT_TRUE(bounds.chains[c]) << bounds.no_chain_bound[c];
  // In order of creation: S, A/t, D/u and E run in each period, then B/a and C.
  EXPECT_EQ(bounds.chains[1]->latency, 5'000'000);
  EXPECT_EQ(bounds.chains[2]->latency, 15'000'000);
}

/// The end of each timer's job wakes up the timer thread of `cbg`, which may then be late.
TEST(ExactWorstCases, JitterUnderATimerThreadThatJobsWakeUpNeedsItToBeReadyAtOnce) {
  const auto refusal = [&](const std::string& jitter, const std::string& platform) {
    const std::string node =
        "  - {name: S, type: sensor, period_ms: 10, execution_time_ms: 1" + jitter + "}\n";
    const GraphBounds bounds =
        bounds_of(node, "platform: {dispatch_cost_us: 0, " + platform + "}\n", "cbg", {.workers = 1});
    EXPECT_EQ(!bounds.refusal, bounds.tasks.size() == 1 && bounds.tasks[0].has_value());
    return bounds.refusal.value_or("");
  };
  const std::string jitter = ", release_jitter_ms: 1", late = "cores: 2, wake_up_us: 100";
  const std::string wakes =
      "with release jitter, it does not cover a timer thread with a wake-up latency that the end of each "
      "timer's job wakes up";
  EXPECT_EQ(refusal(jitter, late), wakes);
  EXPECT_EQ(refusal(jitter, "timer_thread: raised, wake_up_us: 100"), wakes);
  EXPECT_THAT(refusal(jitter, "cores: 1, wake_up_us: 0"), HasSubstr("waits for the executor thread"));
  EXPECT_EQ(refusal(jitter, "cores: 2, wake_up_us: 0"), "");
  EXPECT_EQ(refusal("", late), "");
}

/// A chain that begins inside another has no age of its own.
TEST(ExactWorstCases, WhatAnExplorationMetBeforeItsLimitIsSaidOfTheRightChain) {
  const Graph graph = load(
      "name: g\nnodes:\n"
      "  - {name: S, type: sensor, period_ms: 10, execution_time_ms: 1}\n"
      "  - {name: R, type: sensor, period_ms: 7, execution_time_ms: 1, best_case_execution_time_ms: 0.1}\n"
      "  - name: T\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: S, execution_time_ms: 1, publishes: T}\n"
      "chains:\n"
      "  - {name: tail, nodes: [T/S], sources: [T/S], sink: T/S}\n"
      "  - {name: whole, nodes: [S, T/S], sources: [S], sink: T/S}\n");
  const GraphBounds bounds = bounds::exact_worst_cases(graph, make_tasks(graph), *find_executor("events-ro"),
                                                       {}, {.max_states = 20});
  EXPECT_THAT(bounds.refusal.value(), testing::EndsWith(" ms in whole"));
}

/// a and b end together, while Y and Z keep both threads from R for up to 3 ms: the thread with the higher
/// number publishes r last, and R takes that sample last. In later periods a has either thread.
TEST(ExactWorstCases, NumbersOfThreadsDecideWhoseSampleIsLast) {
  for (const auto& [kind, group_of_a] :
       {std::pair("mutually_exclusive", ""), std::pair("reentrant", ", group: g")}) {
    const GraphBounds bounds = bounds_of(
        program::text(
            "  - name: N\n    type: callbacks\n    groups: {g: %s}\n    callbacks:\n"
            "      - {timer: a, period_ms: 20, execution_time_ms: 4, publishes: [a, r]%s}\n"
            "      - {timer: b, period_ms: 20, execution_time_ms: 4, publishes: [b, r], group: g}\n"
            "  - {name: Y, type: command, input: a, execution_time_ms: 3, best_case_execution_time_ms: 1}\n"
            "  - {name: Z, type: command, input: b, execution_time_ms: 3, best_case_execution_time_ms: 1}\n"
            "  - {name: R, type: command, input: r, execution_time_ms: 1}\n",
            kind, group_of_a),
        "topics: {r: {publishers: many}}\nplatform: {cores: 2}\nchains:\n"
        "  - {name: of_a, nodes: [N/a, R], sources: [N/a], sink: R}\n"
        "  - {name: of_b, nodes: [N/b, R], sources: [N/b], sink: R}\n",
        "multi", {.workers = 2});
    EXPECT_EQ(bounds.refusal, std::nullopt);
    ASSERT_EQ(bounds.chains.size(), 2U);
    for (const auto& chain : bounds.chains) EXPECT_EQ(chain->latency, 9'000'000) << kind;
  }
}

TEST(ExactWorstCases, EarlyPublicationsAreNotCovered) {
  const GraphBounds bounds = bounds_of(
      "  - name: A\n    type: callbacks\n    callbacks:\n"
      "      - {timer: t, period_ms: 10, execution_time_ms: 1, publishes: {topic: a, at_percent: 50}}\n"
      "  - {name: C, type: command, input: a, execution_time_ms: 1}\n");
  EXPECT_THAT(bounds.refusal.value(), HasSubstr("callback A/t, which publishes before the end of its jobs"));
}

}  // namespace hotpath::exact_worst_cases_test
