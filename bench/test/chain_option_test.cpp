// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

#include "hotpath/reference_system/reference_node.hpp"
#include "program/errors.hpp"

namespace hotpath {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// S -> F -> C, and T, whose data goes nowhere.
Graph small_graph() {
  Graph graph;
  for (const char* name : {"S", "T", "F", "C"}) {
    ReferenceNode node;
    node.name = name;
    node.period = node.deadline = std::chrono::milliseconds(10);
    if (node.name == "S" || node.name == "T") {
      node.outputs = {name};
    } else if (node.name == "F") {
      node.type = NodeType::transform;
      node.inputs = {{"S", 1, std::nullopt}};
      node.outputs = {name};
    } else {
      node.type = NodeType::command;
      node.inputs = {{"F", 1, std::nullopt}};
    }
    graph.nodes.push_back(node);
  }
  return graph;
}

std::string error_of(const std::string& chain) {
  const Graph graph = small_graph();
  try {
    static_cast<void>(imports::chain_of(chain, graph, make_tasks(graph)));
    return "accepted";
  } catch (const program::UsageError& error) {
    return error.what();
  }
}

TEST(ChainOption, ConsistsOfTheTasksBetweenSourceAndSink) {
  const Graph graph = small_graph();
  const Chain chain = imports::chain_of("S:C", graph, make_tasks(graph));
  EXPECT_EQ(chain.name, "C");
  EXPECT_THAT(chain.sources, ElementsAre("S"));
  EXPECT_THAT(chain.nodes, ElementsAre("S", "F/S", "C/F"));
  EXPECT_EQ(chain.sink, "C/F");
}

TEST(ChainOption, BeginsAtTimersWhoseDataReachesTheSink) {
  EXPECT_THAT(error_of("F:C"), HasSubstr("F is not a timer"));
  EXPECT_THAT(error_of("S,T:C"), HasSubstr("no data flows from T to C"));
  EXPECT_THAT(error_of("C"), HasSubstr("is not SOURCE"));
  EXPECT_THAT(error_of("S:D"), HasSubstr("D is not a node or task"));
}

}  // namespace
}  // namespace hotpath
