// SPDX-License-Identifier: Apache-2.0
// The inputs that load_graph accepts, and its messages with file and line for the others.
#include "hotpath/reference_system/graph_file.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <tuple>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/graph_keys.hpp"

namespace hotpath::graph_file_test {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kSensor = "- {name: S, type: sensor, period_ms: 10}\n";
const std::string kN = "- {name: N, type: sensor, period_ms: 10, ";

/// The line once for each number from `first` to `last`, which replaces `#`; the one before replaces `@`.
std::string numbered(int first, int last, const std::string& line) {
  std::string text;
  for (int i = first; i <= last; ++i)
    for (const char c : line)
      text += c == '#' ? std::to_string(i) : c == '@' ? std::to_string(i - 1) : std::string{c};
  return text;
}

/// Loads nodes in flow style, one per line from line 3 on.
Graph load_nodes(const std::string& lines) { return load("name: g\nnodes:\n" + lines); }
std::string error_of_nodes(const std::string& lines) { return error_of("name: g\nnodes:\n" + lines); }

TEST(GraphFile, GivesUpstreamsDefaults) {
  const Graph graph = load_nodes(kSensor + "- {name: T, type: transform, input: S, execution_time_ms: 2}\n" +
                                 "- {name: C, type: command, input: T}\n");
  EXPECT_EQ(graph.work, WorkMode::cpu_time);
  EXPECT_EQ(graph.nodes[0].callbacks[0].deadline, 10ms);
  EXPECT_FALSE(graph.nodes[0].callbacks[0].phase);
  EXPECT_EQ(load_nodes("- {name: S, type: sensor, period_ms: 33.333333}").nodes[0].callbacks[0].period,
            33'333'333ns);
  EXPECT_THAT(graph.nodes[0].outputs, ElementsAre("S"));
  EXPECT_EQ(graph.nodes[1].inputs[0].depth, 1U);
  EXPECT_EQ(graph.nodes[1].callbacks[0].best, 2ms);
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 10U);
  EXPECT_TRUE(graph.nodes[2].outputs.empty());
}

TEST(GraphFile, ReadsEveryKey) {
  const Graph graph = load(kEverything);
  const Callback& sensor = graph.nodes[0].callbacks[0];
  EXPECT_EQ(graph.work, WorkMode::fixed);
  EXPECT_EQ(graph.description, "all that a graph can say: # it");
  EXPECT_EQ(std::tuple(sensor.period, *sensor.phase, sensor.release_jitter, sensor.deadline),
            std::tuple(12'500us, 250us, 1'500us, 7ms));
  EXPECT_EQ(sensor.priority, -3);
  EXPECT_EQ(sensor.best, 1ns);
  EXPECT_THAT(graph.nodes[0].groups, ElementsAre(CallbackGroup::reentrant));
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 5U);
  EXPECT_EQ(graph.nodes[2].callbacks[0].priority, 9);
  EXPECT_THAT(graph.nodes[2].outputs, ElementsAre("a", "b"));
  EXPECT_THAT(graph.chains[0].nodes, ElementsAre("S", "I", "K/a"));  // creation order
  const GraphTasks tasks = make_tasks(graph);
  const auto entity_of = [&](const char* name) { return tasks.set[task_named(tasks, name)].entity; };
  EXPECT_EQ(entity_of("K/a"), EntityKind::service);
  EXPECT_EQ(entity_of("K/b"), EntityKind::client);
  EXPECT_EQ(entity_of("W/l"), EntityKind::waitable);
  EXPECT_EQ(entity_of("Y/b"), EntityKind::intra_process) << "of an intra-process topic";
  const GraphPlatform& platform = graph.platform;
  EXPECT_EQ(platform.cores, 2U);
  EXPECT_EQ(platform.timer_thread, TimerThread::equal);
  EXPECT_EQ(platform.execution_times, ExecutionTimeModel::uniform);
  std::vector<std::int64_t> costs;
  costs.reserve(kPlatformCosts.size());
  for (const PlatformCost& cost : kPlatformCosts) costs.push_back((platform.*cost.value).count());
  EXPECT_THAT(costs, ElementsAre(12'500, 3'000, 1, 1, 7'000, 41'000, 25, 190'000, 1'000'000));
}

/// What the documentation says of a key, it says of its name.
TEST(GraphKeys, AreInTheDocumentationAndInTheGraphOfTheTests) {
  std::stringstream docs;
  for (const char* page : {"graphs", "simulation", "results"})
    docs << std::ifstream(std::string(HOTPATH_DOCS_DIR) + "/" + page + ".md").rdbuf();
  for (const std::string& key : key_names(~0U))
    EXPECT_THAT(docs.str(), testing::ContainsRegex("[`{ ]" + key + "[`:]")) << key;
  for (const std::string& key : key_names(~graph_keys::kTimed))  // graph_writer_test has timers and files
    EXPECT_THAT(kEverything + "{file:", testing::ContainsRegex("[{ \n]" + key + ":"));
}

TEST(GraphFile, MistakesInTheFileAreRefused) {
  const std::vector<Mistake> cases = {
      {"", kAnyLine, {"empty"}},
      {"- 1\n", 1},
      {"name: g\nnodes: [}\n", 2, {"not valid YAML"}},
      {"name: g\nnodes:\n- {name: S, type: sensor\n", kAnyLine, {"not valid YAML"}},
      {"name: a\n---\nname: b\n", kAnyLine, {"several YAML documents"}},
      {std::string(2000, '['), kAnyLine, {"not valid YAML"}},
      {"name: g\ndescripton: x\nnodes:\n" + kSensor, 2, {"`descripton`", "did you mean `description`?"}},
      {"name: g\ntopics:\n  S: {publisher: many}\nnodes:\n" + kSensor, 3, {"did you mean `publishers`?"}},
      {"name: g\ntopics:\n  Z: {publishers: many}\nnodes:\n" + kSensor, 3, {"no node publishes topic Z"}},
      {"nodes:\n" + kSensor, 1, {"`name` is missing"}},
      {"name: g\n", kAnyLine, {"`nodes` is missing"}},
      {"name: [g]\nnodes:\n" + kSensor, 1, {"is a list"}},
      {"name: g\nnodes: 3\n", 2, {"is `3`"}},
      {"name: g\nnodes: []\n", 2, {"empty list"}},
      {"name: g\nwork: walls\nnodes:\n" + kSensor, 2, {"fixed, wall, cpu_time", "did you mean `wall`?"}},
      {"name: g\nservice_wait_ms: 100\nnodes:\n" + kSensor, 2, {"no callback of the graph is a service"}},
  };
  for (const Mistake& c : cases) expect_error(error_of(c.text), c.line, c.parts);
  EXPECT_EQ(error_of("name: g\nservice_wait_ms: 100\nnodes:\n" + kSensor +
                     "- {name: N, type: callbacks, callbacks: [{subscription: S, service: true}]}\n"),
            "");
}

/// Each after the sensor S of 10 ms in line 3.
TEST(GraphFile, MistakesInNodesAreRefused) {
  const std::vector<Mistake> cases = {
      // Keys.
      {"- name: N\n  type: sensor\n  periode_ms: 10\n", 6, {"did you mean `period_ms`?"}},
      {"- {name: T, type: transform, input: {topik: S}}", 4, {"did you mean `topic`?"}},
      {"- {name: X, type: intersection, connections: [{input: S, outputs: a}]}", 4, {"`output`?"}},
      {"- {name: T, type: transform, input: S, period_ms: 5}", 4, {"is not a key of transform T"}},
      {kN + "inputs: [S]}", 4, {"`inputs` is not a key of sensor N"}},
      {"- {name: C, type: command, input: S, output: x}", 4, {"`output` is not a key of command C"}},
      {"- name: N\n  type: sensor\n  period_ms: 10\n  period_ms: 11\n", 7, {"twice", "line 6"}},
      {"- {type: sensor, period_ms: 10}", 4, {"`name` is missing"}},
      {"- {name: T}", 4, {"`type` is missing"}},
      {"- {name: N, type: sensor}", 4, {"`period_ms` is missing in sensor N"}},
      {"- {name: X, type: intersection}", 4, {"`connections` is missing"}},
      {"chains:\n- {name: c, sources: [S], sink: S}", 5, {"`nodes` is missing in chain c"}},
      {"chains:\n- {name: c, source: [S], nodes: [S], sink: S}", 5, {"did you mean `sources`?"}},
      // Kinds of values.
      {"- N", 4, {"a node is `N`"}},
      {"- {name: N, type: sensor, period_ms: fast}", 4, {"`period_ms` of sensor N is `fast`"}},
      {"- {name: N, type: sensor, period_ms: }", 4, {"is empty"}},
      {"- {name: N, type: sensor, period_ms: 1e3}", 4, {"is `1e3`"}},
      {"- {name: N, type: sensor, period_ms: 0.0000001}", 4, {"at most six digits after the point"}},
      {"- {name: N, type: sensor, period_ms: 99999999999}", 4, {"up to 999999999"}},
      {kN + "priority: high}", 4, {"give a whole number"}},
      {kN + "callback_group: none}", 4, {"mutually_exclusive, reentrant"}},
      {"- name: N\n  type: sensr\n", 5, {"sensor, transform, fusion, cyclic, intersection", "`sensor`?"}},
      {"- {name: N, type: sensor, period_ms: 0}", 4, {"is 0", "more than 0"}},
      {"- {name: N, type: sensor, period_ms: -10}", 4, {"is negative", "more than 0"}},
      {kN + "deadline_ms: 0}", 4, {"is 0"}},
      {kN + "deadline_ms: -1}", 4, {"is negative"}},
      {kN + "phase_ms: -0.5}", 4, {"is negative", "0 or more"}},
      {kN + "execution_time_ms: -0.5}", 4, {"is negative"}},
      {kN + "best_case_execution_time_ms: -0.5}", 4, {"is negative"}},
      {kN + "release_jitter_ms: -0.5}", 4, {"is negative"}},
      {kN + "release_jitter_ms: 10}", 4, {"jitter of sensor N is not below"}},
      {kN + "execution_time_ms: 2, best_case_execution_time_ms: 2.1}", 4, {"best case of node N"}},
      {"- name: T\n  type: transform\n  input:\n    topic: S\n    depth: 0\n", 8, {"from 1 to"}},
      // Names and topics.
      {kSensor, 4, {"two nodes", "line 3"}},
      {"- {name: " + std::string(48, 'n') + ", type: sensor, period_ms: 1}", 4, {"48 bytes"}},
      {kN + "output: Lidar}\n- name: T\n  type: transform\n  input: lidr\n",
       7,
       {"topic lidr, which", "`Lidar`?"}},
      {"- {name: T, type: transform, input: qqqq}", 4, {"add a node with `output: qqqq`"}},
      {"- {name: F, type: fusion, inputs: [S, S]}", 4, {"twice"}},
      {"- name: R\n  type: sensor\n  period_ms: 10\n  output: S",
       7,
       {"node S does", "line 3", "publishers: many"}},
      // Numbers of inputs.
      {"- {name: N, type: transform}", 4, {"exactly one"}},
      {"- {name: N, type: transform, inputs: [S, S]}", 4, {"has 2 inputs"}},
      {"- {name: N, type: fusion, inputs: [S]}", 4, {"a fusion needs two or more"}},
      {"- {name: N, type: cyclic, period_ms: 10}", 4, {"has no input"}},
      {"- {name: N, type: command}", 4, {"exactly one"}},
      {"- {name: N, type: command, input: S, inputs: [S]}", 4, {"both `input` and `inputs`"}},
      {"- {name: N, type: intersection, connections: []}", 4, {"empty list"}},
      {"- {name: N, type: transform, input: S, output: [a, b]}", 4, {"is a list"}},
      // Cycles, which may have nodes before and a tail of nodes after them.
      {"- {name: A, type: transform, input: A}", 4, {"A -> A form a cycle without a timer"}},
      {"- {name: Tail, type: command, input: T}\n- {name: F, type: fusion, inputs: [S, B]}\n"
       "- {name: T, type: transform, input: B}\n- {name: B, type: transform, input: F}",
       5,
       {"F -> B -> F"}},
      // The platform.
      {"platform: fast", 4, {"give a map"}},
      {"platform:\n  cores: 0", 5, {"`cores`", "from 1 to 64"}},
      {"platform:\n  cores: 1.5", 5, {"whole number"}},
      {"platform:\n  dispatch_cost_us: -1", 5, {"is negative"}},
      {"platform:\n  release_cost_us: 0.0001", 5, {"decimal microseconds", "at most three digits"}},
      {"platform:\n  wake_up_us: soon", 5, {"is `soon`"}},
      {"platform:\n  execution_times: best", 5, {"worst, uniform"}},
      {"platform:\n  release_cost_ms: 1", 5, {"did you mean `release_cost_us`?"}},
      // No chain begins with a sample that waits for a set.
      {"- {name: B, type: sensor, period_ms: 5}\n- {name: F, type: fusion, inputs: [S, B]}\n"
       "chains:\n- {name: c, nodes: [F/S], sources: [F/S], sink: F/S}",
       7,
       {"source F/S", "begin with"}},
  };
  for (const Mistake& c : cases) expect_error(error_of_nodes(kSensor + c.text + "\n"), c.line, c.parts);
  for (std::string node : {"''", "a/b", "'a,b'", "'a\"b'", "\"a'b\"", "a b", "\"a\\nb\""}) {
    node.insert(0, "- {name: ").append(", type: sensor, period_ms: 1}\n");
    expect_error(error_of_nodes(kSensor + node), 4);
  }
}

TEST(GraphFile, WhatIsJustAllowed) {
  for (const std::string& nodes :
       {"- {name: " + std::string(47, 'n') + ", type: sensor, period_ms: 1, phase_ms: 0}\n",
        std::string("- {name: F, type: fusion, inputs: [S, B]}\n- {name: T, type: transform, input: B}\n"
                    "- {name: B, type: cyclic, period_ms: 5, inputs: [F]}\n"),
        // Connections are separate: only a path back into the same one closes a cycle.
        std::string(
            "- {name: X, type: intersection, connections: [{input: S, output: a}, {input: a, output: b}]}\n"),
        std::string("- {name: R, type: sensor, period_ms: 9, output: S}\ntopics: {S: {publishers: many}}\n")})
    EXPECT_EQ(error_of_nodes(kSensor + nodes), "") << nodes;
}

TEST(GraphFile, TextsAreUtf8) {
  EXPECT_EQ(load("name: g\ndescription: Größe → 4 kB \U0001F916\nnodes:\n" + kSensor).name, "g");
  const std::vector<std::pair<std::string, int>> places = {
      {"name: g\nnodes:\n- {name: N!, type: sensor, period_ms: 1}\n", 3},
      {"name: g\nnodes:\n- {name: N, type: sensor, period_ms: 1, output: t!}\n", 3},
      {"name: g!\nnodes:\n" + kSensor, 1},
      {"name: g\ndescription: d!\nnodes:\n" + kSensor, 2},
      {"name: g\ntopics:\n  t!: {publishers: many}\nnodes:\n" + kSensor, 3}};
  // A lone continuation byte, Latin-1, a truncated sequence, an overlong one, a surrogate, beyond Unicode.
  for (const char* bad : {"\x80", "\xE4", "\xE2\x82", "\xC0\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80"}) {
    for (auto [text, line] : places) {
      text.replace(text.find('!'), 1, bad);
      expect_error(error_of(text), line, {"is not valid UTF-8; save the file"});
    }
  }
}

TEST(GraphFile, TheOrderOfDeliveryNamesEachSubscriberOnce) {
  const std::string nodes = "nodes:\n" + kSensor +
                            "- {name: A, type: transform, input: S}\n- {name: B, type: transform, input: S}\n"
                            "- {name: C, type: command, input: A}\n";
  const auto error = [&](const std::string& rule) {
    return error_of("name: g\ntopics:\n  S: " + rule + nodes);
  };
  const Graph stated = load("name: g\ntopics: {S: {delivery: [B, A]}}\n" + nodes);
  EXPECT_EQ(stated.delivery.at("S").nodes, (std::vector<std::string>{"B", "A"}));
  EXPECT_TRUE(unknown_deliveries(stated).empty());
  const Graph open = load("name: g\ntopics: {S: {delivery: unknown}, A: {delivery: unknown}}\n" + nodes);
  EXPECT_EQ(unknown_deliveries(open), std::vector<std::string>{"S"});  // A has one subscriber
  expect_error(error("{delivery: [B]}\n"), 3, {"lacks subscriber A"});
  expect_error(error("{delivery: [B, A, B]}\n"), 3, {"lists node B twice"});
  expect_error(error("{delivery: [B, A, C]}\n"), 3, {"does not subscribe"});
  expect_error(error("{delivery: random}\n"), 3, {"unknown"});
  expect_error(error("{}\n"), 3, {"has no rule"});
}

TEST(GraphFile, AMessageHasRoomForTheStatisticsOf63Nodes) {
  const auto line_of_nodes = [](int nodes) {
    return "- {name: N0, type: sensor, period_ms: 10}\n" +
           numbered(1, nodes - 1, "- {name: N#, type: transform, input: N@}\n");
  };
  EXPECT_EQ(load_nodes(line_of_nodes(63)).nodes.size(), 63U);
  expect_error(error_of_nodes(line_of_nodes(64)), 66, {"node N63", "64"});
}

TEST(GraphFile, OneMessageDescendsFromOneOfManyPublishers) {
  EXPECT_EQ(load_nodes(numbered(1, 70, "- {name: S#, type: sensor, period_ms: 10, output: Data}\n") +
                       "- {name: T, type: transform, input: Data}\n- {name: C, type: command, input: T}\n" +
                       "topics: {Data: {publishers: many}}\n")
                .nodes.size(),
            72U);
}

TEST(GraphFile, ACyclicNodePassesOnTheHistoryOfItsInputs) {
  expect_error(
      error_of_nodes("- {name: Y, type: cyclic, period_ms: 10, inputs: [S0" + numbered(1, 62, ", S#") +
                     "]}\n" + numbered(0, 62, "- {name: S#, type: sensor, period_ms: 10}\n")),
      3, {"node Y", "64"});
}

TEST(ChainOf, KnownNodesFromTimersToAReachableSink) {
  const auto error = [](const std::string& nodes, const std::string& sources, const std::string& sink) {
    return error_of_nodes(
        kSensor + "- {name: T, type: transform, input: S}\n- {name: C, type: command, input: T}\n" +
        "- {name: Other, type: sensor, period_ms: 5}\nchains:\n- name: c\n  nodes: " + nodes +
        "\n  sources: " + sources + "\n  sink: " + sink + "\n");
  };
  EXPECT_EQ(error("[S, T, C]", "[S]", "C"), "");
  expect_error(error("[S, TT, C]", "[S]", "C"), 9, {"unknown node TT"});
  expect_error(error("[S, T, C]", "[Z]", "C"), 10, {"unknown node Z"});
  expect_error(error("[S, T, C]", "[S]", "Z"), 11, {"unknown node Z"});
  expect_error(error("[S, T, C]", "[]", "C"), 10, {"empty list"});
  expect_error(error("[S, T, C]", "[T]", "C"), 10, {"has no timer"});
  expect_error(error("[S, T, C, Other]", "[S, Other]", "C"), 10, {"cannot be reached from source Other"});
  expect_error(error("[S, C]", "[S]", "C"), kAnyLine, {"cannot be reached", "they end at S"});  // through T
  expect_error(error("[S, T]", "[S]", "C"), 11, {"missing in `nodes`"});
  expect_error(error("[S, T, T, C]", "[S]", "C"), 9, {"twice"});
}

TEST(ChainOf, ItsEndsWithoutSourcesOrSink) {
  const std::string nodes =
      kSensor + "- {name: O, type: sensor, period_ms: 5}\n" +
      "- {name: F, type: fusion, inputs: [S, O]}\n- {name: C, type: command, input: F}\n" +
      "- {name: Y, type: cyclic, period_ms: 20, inputs: [F, Z]}\n" +
      "- {name: Z, type: transform, input: Y}\nchains:\n- {name: c, nodes: ";
  const Chain whole = load_nodes(nodes + "[S, O, F, C]}").chains.front();
  EXPECT_THAT(whole.sources, ElementsAre("S", "O"));
  EXPECT_EQ(whole.sink, "C");
  const Chain part = load_nodes(nodes + "[O, F], sink: F}").chains.front();
  EXPECT_THAT(part.sources, ElementsAre("O"));
  EXPECT_EQ(load_nodes(nodes + "[S, F], sources: [S]}").chains.front().sink, "F");
  expect_error(error_of_nodes(nodes + "[S, F, C, Y]}"), 10,
               {"chain c has no `sink`", "C and Y", "`sink: C`"});
  expect_error(error_of_nodes(nodes + "[Y, Z]}"), 10, {"ends in a cycle", "`sink: Y`"});
  expect_error(error_of_nodes(nodes + "[Y, Z], sink: Z}"), 10, {"has no `sources`", "`sources: [Y]`"});
  expect_error(error_of_nodes(nodes + "[F, C]}"), 10, {"source F of chain c has no timer"});
  expect_error(error_of_nodes(nodes + "[O, C]}"), 10, {"a gap before C", "from O to C"});
  expect_error(error_of_nodes(nodes + "[S, FF]}"), 10, {"unknown node FF"});
}

TEST(ValuesToSet, ReplaceThoseOfTheFile) {
  const File file("set.yaml",
                  "name: g\nnodes:\n- {name: Lidar, type: sensor, period_ms: &p 10}\n" +
                      std::string("- {name: T, type: sensor, period_ms: *p}\n- name: K\n") +
                      "  type: callbacks\n  callbacks: [{timer: t, period_ms: 7}, {subscription: Lidar}]\n");
  const Graph graph =
      load_graph(file.path(), {"Lidar.period_ms=0.5", "Lidar.priority=3", "K/t.execution_time_ms=2",
                               "K/Lidar.depth=4", "Lidar.period_ms=2.5"});
  EXPECT_EQ(graph.nodes[0].callbacks[0].period, 2'500us);
  EXPECT_EQ(graph.nodes[0].callbacks[0].priority, 3);
  EXPECT_EQ(graph.nodes[1].callbacks[0].period, 10ms) << "its alias";
  EXPECT_EQ(graph.nodes[2].callbacks[0].worst, 2ms);
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 4U);
  const auto error = [&](const std::string& setting) {
    try {
      static_cast<void>(load_graph(file.path(), {setting}));
    } catch (const InputError& wrong) {
      return std::string(wrong.what());
    }
    return std::string();
  };
  for (const char* form : {"Lidar", "Lidar=3", "Lidar.period_ms", "=Lidar.period_ms"})
    EXPECT_THAT(error(form), AllOf(StartsWith("--set "), HasSubstr("is not NODE.KEY=VALUE"))) << form;
  EXPECT_THAT(error("Lidr.period_ms=3"), HasSubstr("no node Lidr; did you mean `Lidar`?"));
  EXPECT_THAT(error("Lokal.period_ms=3"), HasSubstr("no node Lokal; choose one of: K/Lidar, K/t, Lidar, T"));
  EXPECT_THAT(error("Lidar.perod_ms=3"),
              HasSubstr(file.path() + ":3: unknown key `perod_ms` in sensor Lidar; did you"));
  EXPECT_THAT(error("K/t.period_ms=0"), HasSubstr("`period_ms` of timer K/t is 0"));
  for (const char* text : {"nodes: {a: b}", "nodes: 3", "x: 1", "nodes: [1, {name: [x], callbacks: 3}]"}) {
    const File other("other.yaml", text);
    EXPECT_THROW(static_cast<void>(load_graph(other.path(), {"A.b=1"})), InputError) << text;
  }
}

}  // namespace hotpath::graph_file_test
