// SPDX-License-Identifier: Apache-2.0
#include "results/swapped_arrivals.hpp"

#include <gtest/gtest.h>

#include "hotpath/reference_system/reference_node.hpp"

namespace hotpath {
namespace {

/// S is read by A, B and C.
Graph three_readers() {
  Graph g;
  for (const char* name : {"S", "A", "B", "C"}) {
    ReferenceNode node;
    node.name = name;
    if (name == std::string("S")) {
      node.period = node.deadline = std::chrono::milliseconds(10);
      node.outputs = {name};
    } else {
      node.type = NodeType::command;
      node.inputs = {{"S", 1, std::nullopt}};
    }
    g.nodes.push_back(node);
  }
  return g;
}

JobRecord arrival(TaskId task, std::uint64_t message, std::int64_t ns) {
  JobRecord r;
  r.job.task = task;
  r.job.parent = {0, message};
  r.job.release = Time{} + Duration(ns);
  return r;
}

TEST(SwappedArrivals, ComparesNeighboursOfTheGraphsOrder) {
  Graph g = three_readers();
  Trace trace;
  trace.jobs = {arrival(1, 0, 10),  arrival(2, 0, 20),  arrival(3, 0, 30),  arrival(1, 1, 130),
                arrival(2, 1, 120), arrival(3, 1, 130), arrival(3, 2, 200), arrival(1, 3, 300),
                arrival(2, 3, 300), arrival(3, 3, 300)};  // the last ones at once
  const std::vector<results::SwappedArrivals> swapped = results::swapped_arrivals(make_tasks(g), trace);
  ASSERT_EQ(swapped.size(), 1U);
  EXPECT_EQ(swapped[0].stated_first, 1U);
  EXPECT_EQ(swapped[0].arrived_first, 2U);
  EXPECT_EQ(swapped[0].messages, 3U);
  EXPECT_EQ(swapped[0].swapped, 1U);
  g.delivery["S"].nodes = {"C", "B", "A"};
  EXPECT_EQ(results::swapped_arrivals(make_tasks(g), trace).size(), 2U);
}

}  // namespace
}  // namespace hotpath
