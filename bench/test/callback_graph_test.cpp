// SPDX-License-Identifier: Apache-2.0
// Graphs in the form of the analysis, and callbacks that no method covers.
#include "bounds/bounds.hpp"

#include <gmock/gmock.h>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/reference_system/reference_node.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// S -> N -> C, where N's only callback publishes like this.
Graph graph_with(const std::vector<Publication>& publishes) {
  Graph graph;
  ReferenceNode sensor;
  sensor.name = "S";
  sensor.outputs = {"s"};
  sensor.period = 10ms;
  graph.nodes.push_back(sensor);
  Node& node = graph.nodes.emplace_back();
  node.name = "N";
  node.groups = {CallbackGroup::mutually_exclusive};
  node.inputs = {{"s"}};
  Callback& callback = node.callbacks.emplace_back();
  callback.task = "N/s";
  callback.input = 0;
  callback.publishes = publishes;
  for (const Publication& p : publishes) node.outputs.push_back(p.topic);
  ReferenceNode command;
  command.name = "C";
  command.type = NodeType::command;
  command.inputs = {{publishes.front().topic, 1, std::nullopt}};
  graph.nodes.push_back(command);
  return graph;
}

Publication publication(const std::string& topic) {
  Publication p;
  p.topic = topic;
  return p;
}

CallbackGraph callback_graph_of(const Graph& graph) {
  return bounds::callback_graph(graph, make_tasks(graph), false);
}

std::string refusal(const std::vector<Publication>& publishes) {
  try {
    callback_graph_of(graph_with(publishes));
    return "covered";
  } catch (const AnalysisError& error) {
    return error.what();
  }
}

TEST(CallbackGraph, KnowsHowRarelyATaskPublishes) {
  Publication often = publication("a"), rarely = publication("b");
  rarely.rule = PublishRule::every;
  rarely.n = 3;
  EXPECT_EQ(callback_graph_of(graph_with({often, rarely})).every.at(1), 3U);
  EXPECT_EQ(callback_graph_of(graph_with({rarely, often})).every.at(1), 3U);
  EXPECT_EQ(callback_graph_of(graph_with({often})).every.at(1), 1U);
}

TEST(CallbackGraph, CallbacksThatNoMethodCoversAreRejected) {
  Publication early = publication("a"), set = publication("b");
  EXPECT_EQ(refusal({early}), "covered");
  early.at = 0.5;
  EXPECT_THAT(refusal({early}), HasSubstr("N/s, which publishes before the end of its jobs"));
  set.rule = PublishRule::all_new;
  set.of = {0};
  EXPECT_THAT(refusal({publication("a"), set}), HasSubstr("publishes some topics with every job and others"));
}

}  // namespace
}  // namespace hotpath
