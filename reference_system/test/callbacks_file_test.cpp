// SPDX-License-Identifier: Apache-2.0
// Nodes of type `callbacks` in the file of a graph: their groups, execution times and limits, and
// the mistakes that are reported.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/graph_layout.hpp"

namespace hotpath::callbacks_file_test {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

/// The message for a graph with only this node; empty if the graph is valid.
std::string error_of_node(const std::string& node) {
  return error_of(
      "name: g\nnodes:\n  - {name: S, type: sensor, period_ms: 10}\n  - name: N\n    type: callbacks\n" +
      node);
}

TEST(Callbacks, QuantilesOfExecutionTimesBecomeValuesWithTheseQuantiles) {
  const std::vector<Duration> values = values_of({{0, 1ms}, {50, 2ms}, {95, 4ms}, {99, 8ms}, {100, 9ms}});
  ASSERT_EQ(values.size(), 200U);
  EXPECT_TRUE(std::ranges::is_sorted(values));
  EXPECT_EQ(values.front(), 1ms);
  EXPECT_EQ(values.back(), 9ms);
  for (const auto& [place, time] : {std::pair(99, 2ms), {189, 4ms}, {197, 8ms}}) {
    EXPECT_LT(values.at(place), time);
    EXPECT_GT(values.at(place + 1), time);
  }
}

TEST(Callbacks, AGroupIsOfItsNodeAndTheDefaultIsMutuallyExclusive) {
  const Graph g = load(
      "name: g\nnodes:\n"
      "  - {name: S, type: sensor, period_ms: 10, callback_group: reentrant}\n"
      "  - name: A\n    type: callbacks\n    groups: {r: reentrant, m: mutually_exclusive}\n    callbacks:\n"
      "      - {timer: t, period_ms: 10}\n      - {timer: u, period_ms: 10, group: r}\n"
      "      - {subscription: S, group: m}\n      - {timer: v, period_ms: 10}\n");
  const GraphTasks tasks = make_tasks(g);
  std::vector<std::uint32_t> groups;
  for (const Task& task : tasks.set.tasks) groups.push_back(task.group);
  EXPECT_THAT(groups, ElementsAre(0, 3, 1, 2, 3));
  using enum CallbackGroup;
  EXPECT_THAT(tasks.set.groups, ElementsAre(reentrant, reentrant, mutually_exclusive, mutually_exclusive));
}

TEST(Callbacks, TheHotPathConsistsOfTheTasksInTheChain) {
  std::vector<std::string> hot;
  for (const GraphEdge& edge : graph_edges(load_graph(find_graph("callbacks"))))
    if (edge.hot) hot.push_back(edge.topic);
  EXPECT_THAT(hot, ElementsAre("points", "pose", "path"));
}

TEST(Callbacks, MeasuredTimesFromAFileBesideTheGraph) {
  const File csv("times.csv", "task,execution_time_ms\nx,1.5\nx,0.5\n");
  const std::string name = std::filesystem::path(csv.path()).filename().string();
  const auto node = [](const std::string& file) {
    return "    callbacks:\n      - {timer: t, period_ms: 10, execution_time_ms: {file: " + file + "}}\n";
  };
  EXPECT_EQ(error_of_node(node(name)), "");
  const File bad("bad.csv", "execution_time_ms\n1\n-2\n"), empty("empty.csv", "execution_time_ms\n");
  expect_error(error_of_node(node(bad.path())), kAnyLine, {"bad.csv:3: an execution time is `-2`"});
  expect_error(error_of_node(node(empty.path())), kAnyLine, {"the file has no execution time"});
  expect_error(error_of_node(node("missing.csv")), kAnyLine, {"missing.csv"});
}

TEST(Callbacks, LoadScalesAllOfThem) {
  Graph g = load(
      "name: g\nnodes:\n  - name: A\n    type: callbacks\n    callbacks:\n"
      "      - {timer: t, period_ms: 10, execution_time_ms: {measured: [1, 2]}, publishes: {topic: x, every: "
      "2}}\n"
      "      - {subscription: x, execution_time_ms: 2}\n");
  EXPECT_DOUBLE_EQ(load_percent(g), 30);
  scale_to_load(g, 60);
  EXPECT_THAT(*g.nodes[0].callbacks[0].measured, ElementsAre(2ms, 4ms));
  EXPECT_EQ(make_tasks(g).set[1].wcet, 4ms);
}

TEST(Callbacks, AChainHasAtMostEightSources) {
  std::string nodes = "name: g\nnodes:\n", names;
  for (const char c : std::string("ABCDEFGHI")) {
    nodes += std::string("  - {name: ") + c + ", type: sensor, period_ms: 10, output: x}\n";
    names += (names.empty() ? "" : ", ") + std::string(1, c);
  }
  nodes += "  - {name: Z, type: command, input: x}\ntopics: {x: {publishers: many}}\n";
  nodes += "chains:\n  - {name: c, nodes: [" + names + ", Z], sources: [" + names + "], sink: Z}\n";
  expect_error(error_of(nodes), 15, {"chain c has 9 sources"});
}

TEST(Callbacks, MistakesAreReportedWithTheirLine) {
  const std::string c = "    callbacks:\n", t = "      - {timer: t, period_ms: 10, ",
                    s = "      - {subscription: S, ";
  const std::vector<std::array<std::string, 3>> wrong = {
      {"", ":4: ", "`callbacks` is missing"},
      {"    period_ms: 5\n" + c + t + "}\n", ":6: ", "`period_ms` is not a key of callbacks N"},
      {"    callbacks: []\n", ":6: ", "empty list"},
      {c + "      - {period_ms: 10}\n", ":7: ", "neither timer nor subscription"},
      {c + "      - {timer: t, subscription: S}\n", ":7: ", "both a timer and a subscription"},
      {c + t + "depth: 2}\n", ":7: ", "`depth` is not a key of timer N/t"},
      {c + t + "service: true}\n", ":7: ", "`service` is not a key of timer N/t"},
      {c + s + "service: 1}\n", ":7: ", "give one of: false, true"},
      {c + t + "perod_ms: 2}\n", ":7: ", "unknown key `perod_ms`"},
      {c + "      - {timer: t}\n", ":7: ", "`period_ms` is missing"},
      {c + "      - {timer: t, period_ms: -1}\n", ":7: ", "negative"},
      {c + "      - {timer: a/b, period_ms: 1}\n", ":7: ", "contains /"},
      {c + t + "}\n" + t + "}\n", ":8: ", "two callbacks with the name N/t"},
      {c + "      - {timer: S, period_ms: 1}\n" + s + "}\n", ":8: ", "two callbacks with the name N/S"},
      {c + s + "}\n" + s + "}\n", ":8: ", "two callbacks with the name N/S"},
      {"    groups: {a: reentrant}\n" + c + t + "group: b}\n", ":8: ", "not among `groups`"},
      {c + t + "group: b}\n", ":7: ", "add `groups: {b: reentrant}`"},
      {"    groups: {a: shared}\n" + c + t + "}\n", ":6: ", "mutually_exclusive, reentrant"},
      {c + t + "execution_time_ms: -1}\n", ":7: ", "negative"},
      {c + t + "execution_time_ms: {min: 2, max: 1}}\n", ":7: ", "`min` above its `max`"},
      {c + t + "execution_time_ms: {min: 2, p50: 1, max: 3}}\n", ":7: ", "`min` above its `p50`"},
      {c + t + "execution_time_ms: {min: 2}}\n", ":7: ", "`max` is missing"},
      {c + t + "execution_time_ms: {measured: []}}\n", ":7: ", "empty list"},
      {c + t + "execution_time_ms: {measured: [1, -2]}}\n", ":7: ", "negative"},
      {c + t + "execution_time_ms: {measured: [1], max: 2}}\n", ":7: ", "in two ways"},
      {c + t + "execution_time_ms: {mean: 1}}\n", ":7: ", "unknown key `mean`"},
      {c + t + "publishes: [x, x]}\n", ":7: ", "publishes topic x twice"},
      {c + t + "publishes: []}\n", ":7: ", "empty list"},
      {c + t + "publishes: {every: 2}}\n", ":7: ", "`topic` is missing"},
      {c + t + "publishes: {topic: x, every: 0}}\n", ":7: ", "from 1 to"},
      {c + t + "publishes: {topic: x, every: 2, first: 3}}\n", ":7: ", "an `every` that is not smaller"},
      {c + t + "publishes: {topic: x, when: all_new}}\n", ":7: ", "`of` is missing"},
      {c + t + "publishes: {topic: x, when: all_new, of: []}}\n", ":7: ", "empty list"},
      {c + t + "publishes: {topic: x, when: all_new, of: [S]}}\n", ":7: ", "does not subscribe"},
      {c + s + "publishes: {topic: x, when: all_new, of: [S, S]}}\n", ":7: ", "names topic S twice"},
      {c + s + "publishes: {topic: x, when: sometimes}}\n", ":7: ", "always, all_new"},
      {c + s + "publishes: {topic: x, of: [S]}}\n", ":7: ", "needs the rule all_new"},
      {c + s + "publishes: {topic: x, every: 2, last_of: [S]}}\n", ":7: ", "several rules"},
      {c + t + "publishes: {topic: x, at_percent: 101}}\n", ":7: ", "from 0 to 100"},
      {c + t + "publishes: {topic: x, at_percent: early}}\n", ":7: ", "from 0 to 100"},
      {c + s + "publishes: S}\n", ":7: ", "publishes topic S, as node S does"},
      {c + "      - {subscription: R}\n", ":7: ", "no node publishes"},
      {c + t + "publishes: x}\n      - {timer: u, period_ms: 1, publishes: y}\n" +
           "chains:\n  - {name: c, nodes: [N], sources: [N], sink: N}\n",
       ":10: ", "2 timers; name the task in which data begins, such as N/t"},
      {c + t + "publishes: x}\nchains:\n  - {name: c, nodes: [N/u], sources: [N/u], sink: N/u}\n",
       ":9: ", "did you mean `N/t`"},
      {c + s + "}\n" + t + "publishes: {topic: x, last_of: [S]}}\n" +
           "chains:\n  - {name: c, nodes: [S, N/S], sources: [S], sink: N/S}\n",
       ":10: ", "only stores its samples"},
      {c + s +
           "publishes: x}\n      - {subscription: x, publishes: y}\n      - {subscription: y, publishes: "
           "x}\n",
       ":8", "form a cycle"},
  };
  for (const auto& [text, line, problem] : wrong) {
    EXPECT_THAT(error_of_node(text), testing::AllOf(HasSubstr(line), HasSubstr(problem))) << text;
  }
}

}  // namespace hotpath::callbacks_file_test
