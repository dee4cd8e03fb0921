// SPDX-License-Identifier: Apache-2.0
// Written graphs are read back as the same graphs.
#include "hotpath/reference_system/graph_writer.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "graph_fixture.hpp"

namespace hotpath {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

TEST(GraphWriter, WritesEveryShippedGraphAsItWasRead) {
  for (const GraphListing& listing : list_graphs()) {
    const Graph graph = load_graph(listing.path);
    EXPECT_EQ(load(graph_yaml(graph)), graph) << listing.name;
  }
}

const std::string kEverything = R"(name: everything
description: "all that a graph can say: # it"
work: fixed
service_wait_ms: 12.5
topics: {t: {publishers: many}, a: {delivery: [K, X, F]}, b: {delivery: unknown}}
platform: {cores: 2, timer_thread: raised, execution_times: measured, timer_dispatch_cost_us: 1.5, subscription_dispatch_cost_us: 0, wake_up_us: 3.5, wait_cost_per_entity_us: 0.025}
nodes:
- {name: S, type: sensor, period_ms: 10.5, phase_ms: 0, deadline_ms: 9, release_jitter_ms: 0.5, priority: -3, output: t, execution_time_ms: 2, best_case_execution_time_ms: 0.000001}
- {name: C, type: cyclic, period_ms: 20, inputs: [{topic: t, depth: 4, priority: 2}], callback_group: reentrant}
- {name: I, type: intersection, connections: [{input: t, output: a}, {input: C, output: b}]}
- {name: F, type: fusion, inputs: [a, {topic: b, depth: 2}], output: t2}
- {name: X, type: command, input: {topic: a, depth: 1}}
- {name: Y, type: command, input: b}
- name: K
  type: callbacks
  groups: {g: reentrant, h: mutually_exclusive}
  callbacks:
  - {timer: one, period_ms: 100, phase_ms: 3, deadline_ms: 50, release_jitter_ms: 7, priority: 1, execution_time_ms: {min: 1, max: 2.5}, group: h, publishes: [t, {topic: k, last_of: [b, a]}]}
  - {subscription: a, depth: 3, service: true, execution_time_ms: {measured: [3, 1, 2]}, group: g, publishes: {topic: k, when: all_new, of: [a, b]}}
  - {subscription: b, execution_time_ms: {min: 1, p50: 2, p95: 2.5, p99: 4, max: 9}, publishes: [{topic: l, every: 4, at_percent: 33.3}, {topic: m, at_percent: 0}]}
chains:
- {name: c, nodes: [S, I, K/a], sources: [S], sink: K/a}
)";

TEST(GraphWriter, WritesEveryFeatureOfAGraph) {
  const Graph graph = load(kEverything);
  EXPECT_EQ(load(graph_yaml(graph)), graph) << graph_yaml(graph);
}

TEST(GraphWriter, PutsLongMeasurementsIntoFilesBesideTheGraph) {
  Graph graph = load(kEverything);
  std::vector<Duration> times(kMaxInlineTimes + 1, 5ms);
  times[3] = 1ns;
  Callback& callback = graph.nodes.back().callbacks[1];
  callback.measured = std::make_shared<const std::vector<Duration>>(times);
  callback.best = 1ns;
  callback.worst = 5ms;
  const fs::path folder = testing::TempDir() + "hotpath_graph_writer";
  fs::create_directory(folder);
  write_graph(folder / "mine.yaml", graph);
  EXPECT_TRUE(fs::exists(folder / "mine_times" / "K-a.csv"));
  EXPECT_EQ(load_graph(folder / "mine.yaml"), graph);
  fs::remove_all(folder);
}

TEST(GraphWriter, WritesTheComments) {
  const Graph graph = load(kEverything);
  const std::string text =
      graph_yaml(graph, {"Imported.\nBy test.", {{"S", "a sensor"}, {"K", "a node"}, {"K/a", "half known"}}});
  EXPECT_THAT(text, AllOf(HasSubstr("# Imported.\n# By test.\n"), HasSubstr("}  # a sensor\n"),
                          HasSubstr("name: K  # a node\n"), HasSubstr("}  # half known\n")));
  EXPECT_EQ(load(text), graph);
}

TEST(GraphWriter, NamesTheFileThatCannotBeWritten) {
  EXPECT_THAT([] { write_graph("/nonexistent/mine.yaml", load(kEverything)); },
              testing::ThrowsMessage<InputError>(HasSubstr("mine.yaml")));
}

}  // namespace
}  // namespace hotpath
