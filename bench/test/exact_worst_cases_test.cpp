// SPDX-License-Identifier: Apache-2.0
// The exact method's limits: circles of data and publications before the end of jobs.
#include "bounds/exact_worst_cases.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {
namespace {

using testing::HasSubstr;

GraphBounds bounds_of(const std::string& nodes, const std::string& chains = "") {
  std::string file = std::filesystem::temp_directory_path() / "hotpath-XXXXXX.yaml";
  if (mkstemps(file.data(), 5) < 0) throw std::runtime_error("no file");
  std::ofstream(file) << "name: g\nnodes:\n" << nodes << chains;
  const Graph graph = load_graph(file);
  std::filesystem::remove(file);
  return bounds::exact_worst_cases(graph, make_tasks(graph), *find_executor("events-ro"), {});
}

/// The messages of A's timer return to it; D uses those of B and of S.
TEST(ExactWorstCases, OnlyChainsThroughACircleAreNotCovered) {
  const GraphBounds bounds = bounds_of(
      "  - {name: S, type: sensor, period_ms: 10, execution_time_ms: 1}\n"
      "  - name: A\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: b}\n"
      "      - {timer: t, period_ms: 10, execution_time_ms: 1, publishes: {topic: a, last_of: [b]}}\n"
      "  - name: B\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: a, execution_time_ms: 1, publishes: b}\n"
      "  - name: D\n    type: callbacks\n    callbacks:\n"
      "      - {subscription: b}\n"
      "      - {subscription: S}\n"
      "      - {timer: u, period_ms: 10, execution_time_ms: 1, publishes: {topic: d, last_of: [b, S]}}\n"
      "  - {name: C, type: command, input: d, execution_time_ms: 1}\n",
      "chains:\n"
      "  - {name: behind, nodes: [S, D/S, D/u, C], sources: [S], sink: C}\n"
      "  - {name: circle, nodes: [A/t, B/a], sources: [A/t], sink: B/a}\n");
  EXPECT_EQ(bounds.refusal, "");
  ASSERT_EQ(bounds.chains.size(), 2U);
  EXPECT_TRUE(bounds.chains[0]) << bounds.no_chain_bound[0];
  EXPECT_FALSE(bounds.chains[1]);
  EXPECT_THAT(bounds.no_chain_bound[1], HasSubstr("data goes round in a circle through"));
}

TEST(ExactWorstCases, EarlyPublicationsAreNotCovered) {
  const GraphBounds bounds = bounds_of(
      "  - name: A\n    type: callbacks\n    callbacks:\n"
      "      - {timer: t, period_ms: 10, execution_time_ms: 1, publishes: {topic: a, at_percent: 50}}\n"
      "  - {name: C, type: command, input: a, execution_time_ms: 1}\n");
  EXPECT_THAT(bounds.refusal, HasSubstr("callback A/t, which publishes before the end of its jobs"));
}

}  // namespace
}  // namespace hotpath
