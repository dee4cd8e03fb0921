// SPDX-License-Identifier: Apache-2.0
// The inputs that load_graph accepts, and its messages with file and line for the others.
#include "hotpath/reference_system/graph_file.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "expect_error.hpp"

namespace hotpath {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class GraphFile : public testing::Test {
 protected:
  GraphFile() {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = testing::TempDir() + "hotpath_" + test->name() + ".yaml";
  }
  ~GraphFile() override { std::filesystem::remove(path_); }

  Graph load(const std::string& text) {
    std::ofstream(path_) << text;
    return load_graph(path_);
  }

  /// Loads nodes in flow style, one per line from line 3 on.
  Graph load_nodes(const std::string& lines) { return load("name: g\nnodes:\n" + lines); }

  /// The message without the path: `:LINE: ...`.
  std::string error_of(const std::string& text) {
    try {
      (void)load(text);
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_THAT(message, StartsWith(path_));
      EXPECT_THAT(message, HasSubstr("; ")) << "names no remedy";
      return message.substr(path_.size());
    }
    return "accepted";
  }
  std::string error_of_nodes(const std::string& lines) { return error_of("name: g\nnodes:\n" + lines); }

  std::string path_;
};

const std::string kSensor = "- {name: S, type: sensor, period_ms: 10}\n";

TEST_F(GraphFile, GivesUpstreamsDefaults) {
  const Graph graph = load_nodes(kSensor + "- {name: T, type: transform, input: S, execution_time_ms: 2}\n" +
                                 "- {name: C, type: command, input: T}\n");
  EXPECT_EQ(graph.work, WorkMode::cpu_time);
  EXPECT_EQ(graph.nodes[0].callbacks[0].deadline, std::chrono::milliseconds(10));
  EXPECT_FALSE(graph.nodes[0].callbacks[0].phase);
  EXPECT_THAT(graph.nodes[0].outputs, ElementsAre("S"));
  EXPECT_EQ(graph.nodes[1].inputs[0].depth, 1U);
  EXPECT_EQ(graph.nodes[1].callbacks[0].best, std::chrono::milliseconds(2));
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 10U);
  EXPECT_TRUE(graph.nodes[2].outputs.empty());
}

const std::string kEveryKey = R"(
name: all
description: every key
work: fixed
topics:
  Data: {publishers: many}
nodes:
  - name: S
    type: sensor
    period_ms: 12.5
    phase_ms: 0.25
    deadline_ms: 7
    release_jitter_ms: 1.5
    priority: -3
    output: Data
    execution_time_ms: 2
    best_case_execution_time_ms: 0.000001
    callback_group: reentrant
  - {name: R, type: sensor, period_ms: 20, output: Data}
  - name: X
    type: intersection
    connections:
      - input: {topic: Data, depth: 5, priority: 9}
        output: left
      - {input: other, output: right}
  - {name: Y, type: cyclic, period_ms: 30, inputs: [left], output: other}
chains:
  - {name: c, nodes: [X, S, Y], sources: [S], sink: Y}
platform:
  cores: 2
  timer_thread: equal
  execution_times: uniform
  release_cost_us: 12.5
  pass_cost_us: 3
  subscription_dispatch_cost_us: 7
  dispatch_cost_us: 0.001
  wake_up_us: 190
  delivery_delay_us: 1000
)";

TEST_F(GraphFile, ReadsEveryKey) {
  const Graph graph = load(kEveryKey);
  const Callback& sensor = graph.nodes[0].callbacks[0];
  EXPECT_EQ(graph.work, WorkMode::fixed);
  EXPECT_EQ(graph.description, "every key");
  EXPECT_EQ(sensor.period, std::chrono::microseconds(12500));
  EXPECT_EQ(sensor.phase, std::chrono::microseconds(250));
  EXPECT_EQ(sensor.release_jitter, std::chrono::microseconds(1500));
  EXPECT_EQ(sensor.deadline, std::chrono::milliseconds(7));
  EXPECT_EQ(sensor.priority, -3);
  EXPECT_EQ(sensor.best, Duration(1));
  EXPECT_THAT(graph.nodes[0].groups, ElementsAre(CallbackGroup::reentrant));
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 5U);
  EXPECT_EQ(graph.nodes[2].callbacks[0].priority, 9);
  EXPECT_THAT(graph.nodes[2].outputs, ElementsAre("left", "right"));
  EXPECT_THAT(graph.chains[0].nodes, ElementsAre("S", "X", "Y"));  // creation order
  const GraphPlatform& platform = graph.platform;
  EXPECT_EQ(platform.cores, 2U);
  EXPECT_EQ(platform.timer_thread, TimerThread::equal);
  EXPECT_EQ(platform.execution_times, ExecutionTimeModel::uniform);
  EXPECT_EQ(platform.release_cost, Duration(12'500));
  EXPECT_EQ(platform.pass_cost, std::chrono::microseconds(3));
  EXPECT_EQ(platform.timer_dispatch_cost, Duration(1));
  EXPECT_EQ(platform.subscription_dispatch_cost, std::chrono::microseconds(7));
  EXPECT_EQ(platform.wake_up, std::chrono::microseconds(190));
  EXPECT_EQ(platform.delivery_delay, std::chrono::milliseconds(1));
}

TEST_F(GraphFile, TakesMillisecondsExactlyToTheNanosecond) {
  EXPECT_EQ(load_nodes("- {name: S, type: sensor, period_ms: 33.333333}\n").nodes[0].callbacks[0].period,
            Duration(33'333'333));
  EXPECT_EQ(load_nodes("- {name: S, type: sensor, period_ms: 4.1}\n").nodes[0].callbacks[0].period, Duration(4'100'000));
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 0.0000001}\n"), 3);
}

TEST_F(GraphFile, ThatCannotBeReadIsRefused) {
  EXPECT_THROW((void)load_graph("/nonexistent/graph.yaml"), InputError);
  EXPECT_THROW((void)load_graph(testing::TempDir()), InputError);
  EXPECT_THROW((void)load_graph("/dev/zero"), InputError);
}

TEST_F(GraphFile, ThatIsNotAGraphIsRefused) {
  expect_error(error_of(""), kAnyLine, {"empty"});
  expect_error(error_of("- 1\n"), 1);
  expect_error(error_of("name: g\nnodes: [}\n"), 2, {"not valid YAML"});
  expect_error(error_of("name: g\nnodes:\n- {name: S, type: sensor\n"), kAnyLine, {"not valid YAML"});
  expect_error(error_of("name: a\n---\nname: b\n"), kAnyLine, {"several YAML documents"});
  expect_error(error_of(std::string(2000, '[')), kAnyLine, {"not valid YAML"});
}

TEST_F(GraphFile, UnknownKeysAreRefusedAtEveryLevelWithTheNearestOne) {
  expect_error(error_of("name: g\ndescripton: x\nnodes:\n" + kSensor), 2,
               {"`descripton`", "did you mean `description`?"});
  expect_error(error_of_nodes("- name: S\n  type: sensor\n  periode_ms: 10\n"), 5,
               {"did you mean `period_ms`?"});
  expect_error(error_of_nodes(kSensor + "- {name: T, type: transform, input: {topik: S}}\n"), 4,
               {"did you mean `topic`?"});
  expect_error(
      error_of_nodes("- {name: X, type: intersection, connections: [{input: S, outputs: a}]}\n" + kSensor), 3,
      {"did you mean `output`?"});
  expect_error(error_of("name: g\ntopics:\n  S: {publisher: many}\nnodes:\n" + kSensor), 3,
               {"did you mean `publishers`?"});
  expect_error(error_of_nodes(kSensor + "chains:\n- {name: c, source: [S], nodes: [S], sink: S}\n"), 5,
               {"did you mean `sources`?"});
}

TEST_F(GraphFile, KeysOfOtherNodeTypesAreRefused) {
  expect_error(error_of_nodes(kSensor + "- {name: T, type: transform, input: S, period_ms: 5}\n"), 4,
               {"`period_ms` is not a key of transform T"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 10, inputs: [S]}\n"), kAnyLine,
               {"`inputs` is not a key of sensor S"});
  expect_error(error_of_nodes(kSensor + "- {name: C, type: command, input: S, output: x}\n"), kAnyLine,
               {"`output` is not a key of command C"});
}

TEST_F(GraphFile, RepeatedKeysAreRefused) {
  expect_error(error_of_nodes("- name: S\n  type: sensor\n  period_ms: 10\n  period_ms: 11\n"), 6,
               {"twice", "line 5"});
}

TEST_F(GraphFile, MissingKeysAreNamed) {
  expect_error(error_of("nodes:\n" + kSensor), 1, {"`name` is missing"});
  expect_error(error_of("name: g\n"), kAnyLine, {"`nodes` is missing"});
  expect_error(error_of_nodes(kSensor + "- {type: sensor, period_ms: 10}\n"), 4, {"`name` is missing"});
  expect_error(error_of_nodes(kSensor + "- {name: T}\n"), 4, {"`type` is missing"});
  expect_error(error_of_nodes("- {name: S, type: sensor}\n"), 3, {"`period_ms` is missing in sensor S"});
  expect_error(error_of_nodes(kSensor + "- {name: X, type: intersection}\n"), kAnyLine,
               {"`connections` is missing"});
  expect_error(error_of_nodes(kSensor + "chains:\n- {name: c, nodes: [S], sources: [S]}\n"), 5,
               {"`sink` is missing in chain c"});
}

TEST_F(GraphFile, WrongTypesOfValuesAreRefused) {
  expect_error(error_of("name: [g]\nnodes:\n" + kSensor), 1, {"is a list"});
  expect_error(error_of("name: g\nnodes: 3\n"), 2, {"is `3`"});
  expect_error(error_of("name: g\nnodes: []\n"), 2, {"empty list"});
  expect_error(error_of_nodes("- S\n"), 3, {"a node is `S`"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: fast}\n"), 3,
               {"`period_ms` of sensor S is `fast`"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: }\n"), kAnyLine, {"is empty"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 1e3}\n"), kAnyLine, {"is `1e3`"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 99999999999}\n"), kAnyLine,
               {"up to 999999999"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 10, priority: high}\n"), kAnyLine,
               {"give a whole number"});
  expect_error(error_of("name: g\nwork: walls\nnodes:\n" + kSensor), 2,
               {"fixed, wall, cpu_time", "did you mean `wall`?"});
  expect_error(error_of_nodes("- {name: S, type: sensor, period_ms: 10, callback_group: none}\n"), kAnyLine,
               {"mutually_exclusive, reentrant"});
}

TEST_F(GraphFile, UnknownNodeTypesListTheSix) {
  expect_error(error_of_nodes("- name: S\n  type: sensr\n  period_ms: 10\n"), 4,
               {"sensor, transform, fusion, cyclic, intersection, command", "did you mean `sensor`?"});
}

TEST_F(GraphFile, NodeNamesAreUniqueAndFitIntoMessagesAndColumns) {
  expect_error(error_of_nodes(kSensor + kSensor), 4, {"two nodes", "line 3"});
  EXPECT_EQ(load_nodes("- {name: " + std::string(47, 'n') + ", type: sensor, period_ms: 1}\n").nodes.size(),
            1U);
  expect_error(error_of_nodes("- {name: " + std::string(48, 'n') + ", type: sensor, period_ms: 1}\n"), 3,
               {"48 bytes"});
  for (const std::string name : {"''", "a/b", "'a,b'", "'a\"b'", "\"a'b\"", "a b", "\"a\\nb\""}) {
    expect_error(error_of_nodes("- {name: " + name + ", type: sensor, period_ms: 1}\n"), 3);
  }
}

TEST_F(GraphFile, TextsAreUtf8) {
  EXPECT_EQ(load("name: g\ndescription: Größe → 4 kB \U0001F916\nnodes:\n" + kSensor).name, "g");
  // A lone continuation byte, Latin-1, a truncated sequence, an overlong one, a surrogate, beyond
  // Unicode.
  const auto text = [](const std::string& before, const std::string& bad, const std::string& after) {
    return before + bad + after + "nodes:\n" + kSensor;
  };
  for (const std::string bad : {"\x80", "\xE4", "\xE2\x82", "\xC0\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80"}) {
    const auto refused = [](int line) {
      return AllOf(StartsWith(":" + std::to_string(line) + ": "),
                   HasSubstr("is not valid UTF-8; save the file"));
    };
    EXPECT_THAT(error_of_nodes("- {name: N" + bad + ", type: sensor, period_ms: 1}\n"), refused(3));
    EXPECT_THAT(error_of_nodes("- {name: N, type: sensor, period_ms: 1, output: t" + bad + "}\n"),
                refused(3));
    EXPECT_THAT(error_of(text("name: g", bad, "\n")), refused(1));
    EXPECT_THAT(error_of(text("name: g\ndescription: d", bad, "\n")), refused(2));
    EXPECT_THAT(error_of(text("name: g\ntopics:\n  t", bad, ": {publishers: many}\n")), refused(3));
  }
}

TEST_F(GraphFile, InputsWithoutAPublisherAreRefusedWithTheNearestTopic) {
  expect_error(error_of_nodes("- {name: Lidar, type: sensor, period_ms: 10}\n- name: T\n  type: transform\n"
                              "  input: lidr\n"),
               6, {"topic lidr, which no node publishes", "did you mean `Lidar`?"});
  expect_error(
      error_of_nodes(
          "- {name: Lidar, type: sensor, period_ms: 10}\n- {name: T, type: transform, input: qqqq}\n"),
      kAnyLine, {"add a node with `output: qqqq`"});
}

TEST_F(GraphFile, ASecondPublisherMustBeAllowed) {
  const std::string nodes =
      "nodes:\n" + kSensor + "- name: R\n  type: sensor\n  period_ms: 10\n  output: S\n";
  expect_error(error_of("name: g\n" + nodes), 7, {"node S does", "line 3", "publishers: many"});
  expect_error(error_of("name: g\ntopics: {S: {publishers: one}}\n" + nodes), 8);
  EXPECT_EQ(load("name: g\ntopics: {S: {publishers: many}}\n" + nodes).nodes.size(), 2U);
  expect_error(error_of("name: g\ntopics:\n  Z: {publishers: many}\nnodes:\n" + kSensor), 3,
               {"no node publishes topic Z"});
}

TEST_F(GraphFile, TheOrderOfDeliveryNamesEachSubscriberOnce) {
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

TEST_F(GraphFile, ATopicIsNamedOnceAmongTheInputsOfANode) {
  expect_error(error_of_nodes(kSensor + "- {name: F, type: fusion, inputs: [S, S]}\n"), 4, {"twice"});
}

TEST_F(GraphFile, ACycleNeedsATimer) {
  expect_error(error_of_nodes("- {name: A, type: transform, input: A}\n"), 3,
               {"A -> A form a cycle without a timer"});
  // The cycle is found with nodes before it and a tail of nodes after it.
  const std::string rest =
      "- {name: F, type: fusion, inputs: [S, B]}\n- {name: T, type: transform, input: B}\n";
  expect_error(error_of_nodes("- {name: Tail, type: command, input: T}\n" + kSensor + rest +
                              "- {name: B, type: transform, input: F}\n"),
               5, {"F -> B -> F"});
  const std::string cut = "- {name: B, type: cyclic, period_ms: 5, inputs: [F]}\n";
  EXPECT_EQ(load_nodes(kSensor + rest + cut).nodes.size(), 4U);
  // Connections of an intersection are separate: only a path back into the same connection closes a
  // cycle.
  EXPECT_EQ(load_nodes(kSensor + "- {name: X, type: intersection, connections: [{input: S, output: a}, "
                                 "{input: a, output: b}]}\n")
                .nodes.size(),
            2U);
}

TEST_F(GraphFile, TimesAreNotNegativeAndPeriodsPositive) {
  const auto sensor = [](const std::string& key, const std::string& value) {
    return "- name: S\n  type: sensor\n" + std::string(key == "period_ms" ? "" : "  period_ms: 10\n") + "  " +
           key + ": " + value + "\n";
  };
  expect_error(error_of_nodes(sensor("period_ms", "0")), 5, {"is 0"});
  expect_error(error_of_nodes(sensor("period_ms", "-10")), 5, {"is negative"});
  for (const std::string key :
       {"phase_ms", "deadline_ms", "execution_time_ms", "best_case_execution_time_ms", "release_jitter_ms"}) {
    expect_error(error_of_nodes(sensor(key, "-0.5")), 6, {"is negative"});
  }
  expect_error(error_of_nodes(sensor("deadline_ms", "0")), kAnyLine, {"is 0"});
  expect_error(error_of_nodes(sensor("release_jitter_ms", "10")), 6,
               {"the release jitter of sensor S is not below its period"});
  EXPECT_EQ(load_nodes(sensor("phase_ms", "0")).nodes[0].callbacks[0].phase, Duration::zero());
}

TEST_F(GraphFile, AServiceWaitNeedsAService) {
  const std::string nodes =
      "nodes:\n- {name: S, type: sensor, period_ms: 10}\n"
      "- {name: N, type: callbacks, callbacks: [{subscription: S, service: SERVICE}]}\n";
  const auto with = [&](const std::string& service) {
    return "name: g\nservice_wait_ms: 100\n" + std::string(nodes).replace(nodes.find("SERVICE"), 7, service);
  };
  EXPECT_EQ(error_of(with("true")), "accepted");
  expect_error(error_of(with("false")), 2, {"no callback of the graph is a service"});
}

TEST_F(GraphFile, TheBestCaseIsNotLongerThanTheWorstCase) {
  expect_error(error_of_nodes("- name: S\n  type: sensor\n  period_ms: 10\n  execution_time_ms: 2\n"
                              "  best_case_execution_time_ms: 2.000001\n"),
               7, {"best case of node S"});
}

TEST_F(GraphFile, EachTypeHasItsNumberOfInputs) {
  const auto refused = [&](const std::string& node) {
    return error_of_nodes(kSensor + "- {name: N, " + node + "}\n");
  };
  expect_error(refused("type: transform"), 4, {"exactly one"});
  expect_error(refused("type: transform, inputs: [S, S]"), kAnyLine, {"has 2 inputs"});
  expect_error(refused("type: fusion, inputs: [S]"), kAnyLine, {"a fusion needs two or more"});
  expect_error(refused("type: cyclic, period_ms: 10"), kAnyLine, {"has no input"});
  expect_error(refused("type: command"), kAnyLine, {"exactly one"});
  expect_error(refused("type: command, input: S, inputs: [S]"), kAnyLine, {"both `input` and `inputs`"});
  expect_error(refused("type: intersection, connections: []"), kAnyLine, {"empty list"});
  expect_error(refused("type: transform, input: S, output: [a, b]"), kAnyLine, {"is a list"});
}

TEST_F(GraphFile, ADepthIsAtLeastOne) {
  expect_error(
      error_of_nodes(kSensor + "- name: T\n  type: transform\n  input:\n    topic: S\n    depth: 0\n"), 8,
      {"from 1 to"});
}

TEST_F(GraphFile, AMessageHasRoomForTheStatisticsOf63Nodes) {
  const auto line_of_nodes = [](int nodes) {
    std::string text = "- {name: N0, type: sensor, period_ms: 10}\n";
    for (int i = 1; i < nodes; ++i) {
      text +=
          "- {name: N" + std::to_string(i) + ", type: transform, input: N" + std::to_string(i - 1) + "}\n";
    }
    return text;
  };
  EXPECT_EQ(load_nodes(line_of_nodes(63)).nodes.size(), 63U);
  expect_error(error_of_nodes(line_of_nodes(64)), 66, {"node N63", "64"});
}

TEST_F(GraphFile, OneMessageDescendsFromOneOfManyPublishers) {
  std::string sensors;
  for (int i = 0; i < 70; ++i) {
    sensors += "- {name: S" + std::to_string(i) + ", type: sensor, period_ms: 10, output: Data}\n";
  }
  const std::string rest =
      "- {name: T, type: transform, input: Data}\n- {name: C, type: command, input: T}\n";
  EXPECT_EQ(load("name: g\ntopics: {Data: {publishers: many}}\nnodes:\n" + sensors + rest).nodes.size(), 72U);
}

TEST_F(GraphFile, ACyclicNodePassesOnTheHistoryOfItsInputs) {
  std::string text = "- {name: Y, type: cyclic, period_ms: 10, inputs: [S0";
  for (int i = 1; i < 63; ++i) text += ", S" + std::to_string(i);
  text += "]}\n";
  for (int i = 0; i < 63; ++i) text += "- {name: S" + std::to_string(i) + ", type: sensor, period_ms: 10}\n";
  expect_error(error_of_nodes(text), 3, {"node Y", "64"});
}

TEST_F(GraphFile, ImpossiblePlatformsAreRefused) {
  const auto error = [&](const std::string& keys) {
    return error_of_nodes(kSensor + "platform:\n  timer_thread: raised\n  " + keys + "\n");
  };
  expect_error(error("cores: 0"), 6, {"`cores`", "from 1 to 64"});
  expect_error(error("cores: 1.5"), 6, {"whole number"});
  expect_error(error("dispatch_cost_us: -1"), 6, {"is negative"});
  expect_error(error("release_cost_us: 0.0001"), 6, {"decimal microseconds"});
  expect_error(error("wake_up_us: soon"), 6, {"is `soon`"});
  expect_error(error("execution_times: best"), 6, {"worst, uniform"});
  expect_error(error("release_cost_ms: 1"), 6, {"did you mean `release_cost_us`?"});
  expect_error(error_of_nodes(kSensor + "platform: fast\n"), 4, {"give a map"});
}

class ChainOf : public GraphFile {
 protected:
  std::string error(const std::string& nodes, const std::string& sources, const std::string& sink) {
    return error_of_nodes(
        kSensor + "- {name: T, type: transform, input: S}\n- {name: C, type: command, input: T}\n" +
        "- {name: Other, type: sensor, period_ms: 5}\nchains:\n- name: c\n  nodes: " + nodes +
        "\n  sources: " + sources + "\n  sink: " + sink + "\n");
  }
};

TEST_F(ChainOf, KnownNodesFromTimersToAReachableSink) {
  EXPECT_EQ(error("[S, T, C]", "[S]", "C"), "accepted");
  expect_error(error("[S, TT, C]", "[S]", "C"), 9, {"unknown node TT"});
  expect_error(error("[S, T, C]", "[Z]", "C"), 10, {"unknown node Z"});
  expect_error(error("[S, T, C]", "[S]", "Z"), 11, {"unknown node Z"});
  expect_error(error("[S, T, C]", "[]", "C"), 10, {"empty list"});
  expect_error(error("[S, T, C]", "[T]", "C"), 10, {"has no timer"});
  expect_error(error("[S, T, C, Other]", "[S, Other]", "C"), 10, {"cannot be reached from source Other"});
  expect_error(error("[S, C]", "[S]", "C"), kAnyLine, {"cannot be reached"});  // the path leads through T
  expect_error(error("[S, T]", "[S]", "C"), 11, {"missing in `nodes`"});
  expect_error(error("[S, T, T, C]", "[S]", "C"), 9, {"twice"});
}

TEST_F(GraphFile, NoChainBeginsWithASampleThatWaitsForASet) {
  const auto error = [&](const std::string& source) {
    return error_of_nodes(
        kSensor + "- {name: B, type: sensor, period_ms: 5}\n- {name: F, type: fusion, inputs: [S, B]}\n" +
        "- {name: C, type: command, input: F}\nchains:\n- {name: c, nodes: [" + source + ", C], sources: [" +
        source + "], sink: C}\n");
  };
  expect_error(error("F/S"), 8, {"source F/S", "begin with"});
  expect_error(error("F/B"), 8, {"source F/B", "begin with"});
}

}  // namespace
}  // namespace hotpath
