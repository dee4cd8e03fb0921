// SPDX-License-Identifier: Apache-2.0
// The watcher on simulated runs: no false alarm, and a planted fault is named.
#include "watched_runs.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "reference_nodes.hpp"

namespace hotpath::test {
namespace {

using namespace std::chrono_literals;

void expect_calm(const Graph& graph, const std::string& executor) {
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const CaseResult result = check_watched(graph, executor, seed, false);
    ASSERT_EQ(result.wrong, "") << executor;
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 0U);
}

// While 40 ms of work last 100 ms, the timer thread pays for ten releases: as many as in the time of its own
// jobs, not in that of the work alone.
TEST(ReleaseAndExecute, BudgetsCountTheReleasesDuringTheJobsOfTheTimerThread) {
  Graph graph;
  graph.platform.release_cost = 1ms;
  graph.nodes = {reference_node("slow", NodeType::sensor, {}, 200ms),
                 reference_node("fast", NodeType::sensor, {}, 10ms, 5ms),
                 reference_node("filter", NodeType::transform, {{"slow", 1, {}}}, {}, 40ms)};
  for (const char* executor : {"rm-re", "edf-re", "fp-re"}) expect_calm(graph, executor);
}

// Both timers publish at one instant, at which the other thread takes the first sample between them.
TEST(ReleaseAndExecute, KeepsTheOrderOfThreadsAtOneInstant) {
  Graph graph;
  graph.platform.cores = 2;
  for (const char* name : {"one", "two"}) {
    ReferenceNode node = reference_node(name, NodeType::sensor, {}, 10ms);
    node.outputs = {"points"};
    graph.nodes.push_back(node);
  }
  graph.nodes.push_back(reference_node("filter", NodeType::transform, {{"points", 1, {}}}, {}, 1ms));
  for (const char* executor : {"events-re", "rm-re"}) expect_calm(graph, executor);
}

}  // namespace
}  // namespace hotpath::test
