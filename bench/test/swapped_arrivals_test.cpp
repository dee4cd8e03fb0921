// SPDX-License-Identifier: Apache-2.0
#include "results/schedule.hpp"

#include <gmock/gmock.h>

#include "reference_nodes.hpp"

namespace hotpath::swapped_arrivals_test {

/// S is read by A, B and C.
Graph three_readers() {
  Graph g;
  g.nodes.push_back(reference_node("S", NodeType::sensor, {}, std::chrono::milliseconds(10)));
  for (const char* name : {"A", "B", "C"})
    g.nodes.push_back(reference_node(name, NodeType::command, {{"S", 1, {}}}));
  return g;
}

JobRecord arrival(TaskId task, std::uint64_t message, std::int64_t ns) {
  return {.job = {.task = task, .release = Time{} + Duration(ns), .parent = {0, message}}};
}

TEST(SwappedArrivals, ComparesNeighboursOfTheGraphsOrder) {
  Graph g = three_readers();
  Trace trace;
  trace.jobs = {arrival(1, 0, 10),  arrival(2, 0, 20),  arrival(3, 0, 30),  arrival(1, 1, 130),
                arrival(2, 1, 120), arrival(3, 1, 130), arrival(3, 2, 200), arrival(1, 3, 300),
                arrival(2, 3, 300), arrival(3, 3, 300)};  // the last ones at once
  EXPECT_THAT(results::swapped_arrivals(make_tasks(g), trace),
              testing::ElementsAre(testing::FieldsAre(1U, 2U, 3U, 1U)));
  g.delivery["S"].nodes = {"C", "B", "A"};
  EXPECT_EQ(results::swapped_arrivals(make_tasks(g), trace).size(), 2U);
}

}  // namespace hotpath::swapped_arrivals_test
