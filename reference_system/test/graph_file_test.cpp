// SPDX-License-Identifier: Apache-2.0
// The inputs that load_graph accepts, and its messages with file and line for the others.
#include "hotpath/reference_system/graph_file.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

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
  EXPECT_EQ(graph.nodes[0].deadline, std::chrono::milliseconds(10));
  EXPECT_FALSE(graph.nodes[0].phase);
  EXPECT_THAT(graph.nodes[0].outputs, ElementsAre("S"));
  EXPECT_EQ(graph.nodes[1].inputs[0].depth, 1U);
  EXPECT_EQ(graph.nodes[1].best_case_execution_time, std::chrono::milliseconds(2));
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
  const Node& sensor = graph.nodes[0];
  EXPECT_EQ(graph.work, WorkMode::fixed);
  EXPECT_EQ(graph.description, "every key");
  EXPECT_EQ(sensor.period, std::chrono::microseconds(12500));
  EXPECT_EQ(sensor.phase, std::chrono::microseconds(250));
  EXPECT_EQ(sensor.release_jitter, std::chrono::microseconds(1500));
  EXPECT_EQ(sensor.deadline, std::chrono::milliseconds(7));
  EXPECT_EQ(sensor.priority, -3);
  EXPECT_EQ(sensor.best_case_execution_time, Duration(1));
  EXPECT_EQ(sensor.group, CallbackGroup::reentrant);
  EXPECT_EQ(graph.nodes[2].inputs[0].depth, 5U);
  EXPECT_EQ(graph.nodes[2].inputs[0].priority, 9);
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
  EXPECT_EQ(load_nodes("- {name: S, type: sensor, period_ms: 33.333333}\n").nodes[0].period,
            Duration(33'333'333));
  EXPECT_EQ(load_nodes("- {name: S, type: sensor, period_ms: 4.1}\n").nodes[0].period, Duration(4'100'000));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 0.0000001}\n"), StartsWith(":3: "));
}

TEST_F(GraphFile, ThatCannotBeReadIsRefused) {
  EXPECT_THROW((void)load_graph("/nonexistent/graph.yaml"), InputError);
  EXPECT_THROW((void)load_graph(testing::TempDir()), InputError);
  EXPECT_THROW((void)load_graph("/dev/zero"), InputError);
}

TEST_F(GraphFile, ThatIsNotAGraphIsRefused) {
  EXPECT_THAT(error_of(""), HasSubstr("empty"));
  EXPECT_THAT(error_of("- 1\n"), StartsWith(":1: "));
  EXPECT_THAT(error_of("name: g\nnodes: [}\n"), AllOf(StartsWith(":2: "), HasSubstr("not valid YAML")));
  EXPECT_THAT(error_of("name: g\nnodes:\n- {name: S, type: sensor\n"), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of("name: a\n---\nname: b\n"), HasSubstr("several YAML documents"));
  EXPECT_THAT(error_of(std::string(2000, '[')), HasSubstr("not valid YAML"));
}

TEST_F(GraphFile, UnknownKeysAreRefusedAtEveryLevelWithTheNearestOne) {
  EXPECT_THAT(error_of("name: g\ndescripton: x\nnodes:\n" + kSensor),
              AllOf(StartsWith(":2: "), HasSubstr("`descripton`"), HasSubstr("did you mean `description`?")));
  EXPECT_THAT(error_of_nodes("- name: S\n  type: sensor\n  periode_ms: 10\n"),
              AllOf(StartsWith(":5: "), HasSubstr("did you mean `period_ms`?")));
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: T, type: transform, input: {topik: S}}\n"),
              AllOf(StartsWith(":4: "), HasSubstr("did you mean `topic`?")));
  EXPECT_THAT(
      error_of_nodes("- {name: X, type: intersection, connections: [{input: S, outputs: a}]}\n" + kSensor),
      AllOf(StartsWith(":3: "), HasSubstr("did you mean `output`?")));
  EXPECT_THAT(error_of("name: g\ntopics:\n  S: {publisher: many}\nnodes:\n" + kSensor),
              AllOf(StartsWith(":3: "), HasSubstr("did you mean `publishers`?")));
  EXPECT_THAT(error_of_nodes(kSensor + "chains:\n- {name: c, source: [S], nodes: [S], sink: S}\n"),
              AllOf(StartsWith(":5: "), HasSubstr("did you mean `sources`?")));
}

TEST_F(GraphFile, KeysOfOtherNodeTypesAreRefused) {
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: T, type: transform, input: S, period_ms: 5}\n"),
              AllOf(StartsWith(":4: "), HasSubstr("`period_ms` is not a key of transform T")));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 10, inputs: [S]}\n"),
              HasSubstr("`inputs` is not a key of sensor S"));
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: C, type: command, input: S, output: x}\n"),
              HasSubstr("`output` is not a key of command C"));
}

TEST_F(GraphFile, RepeatedKeysAreRefused) {
  EXPECT_THAT(error_of_nodes("- name: S\n  type: sensor\n  period_ms: 10\n  period_ms: 11\n"),
              AllOf(StartsWith(":6: "), HasSubstr("twice"), HasSubstr("line 5")));
}

TEST_F(GraphFile, MissingKeysAreNamed) {
  EXPECT_THAT(error_of("nodes:\n" + kSensor), AllOf(StartsWith(":1: "), HasSubstr("`name` is missing")));
  EXPECT_THAT(error_of("name: g\n"), HasSubstr("`nodes` is missing"));
  EXPECT_THAT(error_of_nodes(kSensor + "- {type: sensor, period_ms: 10}\n"),
              AllOf(StartsWith(":4: "), HasSubstr("`name` is missing")));
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: T}\n"),
              AllOf(StartsWith(":4: "), HasSubstr("`type` is missing")));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor}\n"),
              AllOf(StartsWith(":3: "), HasSubstr("`period_ms` is missing in sensor S")));
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: X, type: intersection}\n"),
              HasSubstr("`connections` is missing"));
  EXPECT_THAT(error_of_nodes(kSensor + "chains:\n- {name: c, nodes: [S], sources: [S]}\n"),
              AllOf(StartsWith(":5: "), HasSubstr("`sink` is missing in chain c")));
}

TEST_F(GraphFile, WrongTypesOfValuesAreRefused) {
  EXPECT_THAT(error_of("name: [g]\nnodes:\n" + kSensor), AllOf(StartsWith(":1: "), HasSubstr("is a list")));
  EXPECT_THAT(error_of("name: g\nnodes: 3\n"), AllOf(StartsWith(":2: "), HasSubstr("is `3`")));
  EXPECT_THAT(error_of("name: g\nnodes: []\n"), AllOf(StartsWith(":2: "), HasSubstr("empty list")));
  EXPECT_THAT(error_of_nodes("- S\n"), AllOf(StartsWith(":3: "), HasSubstr("a node is `S`")));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: fast}\n"),
              AllOf(StartsWith(":3: "), HasSubstr("`period_ms` of sensor S is `fast`")));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: }\n"), HasSubstr("is empty"));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 1e3}\n"), HasSubstr("is `1e3`"));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 99999999999}\n"),
              HasSubstr("up to 999999999"));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 10, priority: high}\n"),
              HasSubstr("give a whole number"));
  EXPECT_THAT(
      error_of("name: g\nwork: walls\nnodes:\n" + kSensor),
      AllOf(StartsWith(":2: "), HasSubstr("fixed, wall, cpu_time"), HasSubstr("did you mean `wall`?")));
  EXPECT_THAT(error_of_nodes("- {name: S, type: sensor, period_ms: 10, callback_group: none}\n"),
              HasSubstr("mutually_exclusive, reentrant"));
}

TEST_F(GraphFile, UnknownNodeTypesListTheSix) {
  EXPECT_THAT(error_of_nodes("- name: S\n  type: sensr\n  period_ms: 10\n"),
              AllOf(StartsWith(":4: "), HasSubstr("sensor, transform, fusion, cyclic, intersection, command"),
                    HasSubstr("did you mean `sensor`?")));
}

TEST_F(GraphFile, NodeNamesAreUniqueAndFitIntoMessagesAndColumns) {
  EXPECT_THAT(error_of_nodes(kSensor + kSensor),
              AllOf(StartsWith(":4: "), HasSubstr("two nodes"), HasSubstr("line 3")));
  EXPECT_EQ(load_nodes("- {name: " + std::string(47, 'n') + ", type: sensor, period_ms: 1}\n").nodes.size(),
            1U);
  EXPECT_THAT(error_of_nodes("- {name: " + std::string(48, 'n') + ", type: sensor, period_ms: 1}\n"),
              AllOf(StartsWith(":3: "), HasSubstr("48 bytes")));
  for (const std::string name : {"''", "a/b", "'a,b'", "'a\"b'", "\"a'b\"", "a b", "\"a\\nb\""}) {
    EXPECT_THAT(error_of_nodes("- {name: " + name + ", type: sensor, period_ms: 1}\n"), StartsWith(":3: "))
        << name;
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
  EXPECT_THAT(error_of_nodes("- {name: Lidar, type: sensor, period_ms: 10}\n- name: T\n  type: transform\n"
                             "  input: lidr\n"),
              AllOf(StartsWith(":6: "), HasSubstr("topic lidr, which no node publishes"),
                    HasSubstr("did you mean `Lidar`?")));
  EXPECT_THAT(
      error_of_nodes(
          "- {name: Lidar, type: sensor, period_ms: 10}\n- {name: T, type: transform, input: qqqq}\n"),
      HasSubstr("add a node with `output: qqqq`"));
}

TEST_F(GraphFile, ASecondPublisherMustBeAllowed) {
  const std::string nodes =
      "nodes:\n" + kSensor + "- name: R\n  type: sensor\n  period_ms: 10\n  output: S\n";
  EXPECT_THAT(error_of("name: g\n" + nodes), AllOf(StartsWith(":7: "), HasSubstr("node S does"),
                                                   HasSubstr("line 3"), HasSubstr("publishers: many")));
  EXPECT_THAT(error_of("name: g\ntopics: {S: {publishers: one}}\n" + nodes), StartsWith(":8: "));
  EXPECT_EQ(load("name: g\ntopics: {S: {publishers: many}}\n" + nodes).nodes.size(), 2U);
  EXPECT_THAT(error_of("name: g\ntopics:\n  Z: {publishers: many}\nnodes:\n" + kSensor),
              AllOf(StartsWith(":3: "), HasSubstr("no node publishes topic Z")));
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
  EXPECT_THAT(error("{delivery: [B]}\n"), AllOf(StartsWith(":3: "), HasSubstr("lacks subscriber A")));
  EXPECT_THAT(error("{delivery: [B, A, B]}\n"), AllOf(StartsWith(":3: "), HasSubstr("lists node B twice")));
  EXPECT_THAT(error("{delivery: [B, A, C]}\n"), AllOf(StartsWith(":3: "), HasSubstr("does not subscribe")));
  EXPECT_THAT(error("{delivery: random}\n"), AllOf(StartsWith(":3: "), HasSubstr("unknown")));
  EXPECT_THAT(error("{}\n"), AllOf(StartsWith(":3: "), HasSubstr("has no rule")));
}

TEST_F(GraphFile, ATopicIsNamedOnceAmongTheInputsOfANode) {
  EXPECT_THAT(error_of_nodes(kSensor + "- {name: F, type: fusion, inputs: [S, S]}\n"),
              AllOf(StartsWith(":4: "), HasSubstr("twice")));
}

TEST_F(GraphFile, ACycleNeedsATimer) {
  EXPECT_THAT(error_of_nodes("- {name: A, type: transform, input: A}\n"),
              AllOf(StartsWith(":3: "), HasSubstr("A -> A form a cycle without a timer")));
  // The cycle is found with nodes before it and a tail of nodes after it.
  const std::string rest =
      "- {name: F, type: fusion, inputs: [S, B]}\n- {name: T, type: transform, input: B}\n";
  EXPECT_THAT(error_of_nodes("- {name: Tail, type: command, input: T}\n" + kSensor + rest +
                             "- {name: B, type: transform, input: F}\n"),
              AllOf(StartsWith(":5: "), HasSubstr("F -> B -> F")));
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
  EXPECT_THAT(error_of_nodes(sensor("period_ms", "0")), AllOf(StartsWith(":5: "), HasSubstr("is 0")));
  EXPECT_THAT(error_of_nodes(sensor("period_ms", "-10")),
              AllOf(StartsWith(":5: "), HasSubstr("is negative")));
  for (const std::string key :
       {"phase_ms", "deadline_ms", "execution_time_ms", "best_case_execution_time_ms", "release_jitter_ms"}) {
    EXPECT_THAT(error_of_nodes(sensor(key, "-0.5")), AllOf(StartsWith(":6: "), HasSubstr("is negative")))
        << key;
  }
  EXPECT_THAT(error_of_nodes(sensor("deadline_ms", "0")), HasSubstr("is 0"));
  EXPECT_THAT(error_of_nodes(sensor("release_jitter_ms", "10")),
              AllOf(StartsWith(":6: "), HasSubstr("the release jitter of sensor S is not below its period")));
  EXPECT_EQ(load_nodes(sensor("phase_ms", "0")).nodes[0].phase, Duration::zero());
}

TEST_F(GraphFile, AServiceWaitNeedsAService) {
  const std::string nodes =
      "nodes:\n- {name: S, type: sensor, period_ms: 10}\n"
      "- {name: N, type: callbacks, callbacks: [{subscription: S, service: SERVICE}]}\n";
  const auto with = [&](const std::string& service) {
    return "name: g\nservice_wait_ms: 100\n" + std::string(nodes).replace(nodes.find("SERVICE"), 7, service);
  };
  EXPECT_EQ(error_of(with("true")), "accepted");
  EXPECT_THAT(error_of(with("false")),
              AllOf(StartsWith(":2: "), HasSubstr("no callback of the graph is a service")));
}

TEST_F(GraphFile, TheBestCaseIsNotLongerThanTheWorstCase) {
  EXPECT_THAT(error_of_nodes("- name: S\n  type: sensor\n  period_ms: 10\n  execution_time_ms: 2\n"
                             "  best_case_execution_time_ms: 2.000001\n"),
              AllOf(StartsWith(":7: "), HasSubstr("best case of node S")));
}

TEST_F(GraphFile, EachTypeHasItsNumberOfInputs) {
  const auto refused = [&](const std::string& node) {
    return error_of_nodes(kSensor + "- {name: N, " + node + "}\n");
  };
  EXPECT_THAT(refused("type: transform"), AllOf(StartsWith(":4: "), HasSubstr("exactly one")));
  EXPECT_THAT(refused("type: transform, inputs: [S, S]"), HasSubstr("has 2 inputs"));
  EXPECT_THAT(refused("type: fusion, inputs: [S]"), HasSubstr("a fusion needs two or more"));
  EXPECT_THAT(refused("type: cyclic, period_ms: 10"), HasSubstr("has no input"));
  EXPECT_THAT(refused("type: command"), HasSubstr("exactly one"));
  EXPECT_THAT(refused("type: command, input: S, inputs: [S]"), HasSubstr("both `input` and `inputs`"));
  EXPECT_THAT(refused("type: intersection, connections: []"), HasSubstr("empty list"));
  EXPECT_THAT(refused("type: transform, input: S, output: [a, b]"), HasSubstr("is a list"));
}

TEST_F(GraphFile, ADepthIsAtLeastOne) {
  EXPECT_THAT(
      error_of_nodes(kSensor + "- name: T\n  type: transform\n  input:\n    topic: S\n    depth: 0\n"),
      AllOf(StartsWith(":8: "), HasSubstr("from 1 to")));
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
  EXPECT_THAT(error_of_nodes(line_of_nodes(64)),
              AllOf(StartsWith(":66: "), HasSubstr("node N63"), HasSubstr("64")));
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
  EXPECT_THAT(error_of_nodes(text), AllOf(StartsWith(":3: "), HasSubstr("node Y"), HasSubstr("64")));
}

TEST_F(GraphFile, ImpossiblePlatformsAreRefused) {
  const auto error = [&](const std::string& keys) {
    return error_of_nodes(kSensor + "platform:\n  timer_thread: raised\n  " + keys + "\n");
  };
  EXPECT_THAT(error("cores: 0"), AllOf(StartsWith(":6: "), HasSubstr("`cores`"), HasSubstr("from 1 to 64")));
  EXPECT_THAT(error("cores: 1.5"), AllOf(StartsWith(":6: "), HasSubstr("whole number")));
  EXPECT_THAT(error("dispatch_cost_us: -1"), AllOf(StartsWith(":6: "), HasSubstr("is negative")));
  EXPECT_THAT(error("release_cost_us: 0.0001"), AllOf(StartsWith(":6: "), HasSubstr("decimal microseconds")));
  EXPECT_THAT(error("wake_up_us: soon"), AllOf(StartsWith(":6: "), HasSubstr("is `soon`")));
  EXPECT_THAT(error("execution_times: best"), AllOf(StartsWith(":6: "), HasSubstr("worst, uniform")));
  EXPECT_THAT(error("release_cost_ms: 1"),
              AllOf(StartsWith(":6: "), HasSubstr("did you mean `release_cost_us`?")));
  EXPECT_THAT(error_of_nodes(kSensor + "platform: fast\n"),
              AllOf(StartsWith(":4: "), HasSubstr("give a map")));
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
  EXPECT_THAT(error("[S, TT, C]", "[S]", "C"), AllOf(StartsWith(":9: "), HasSubstr("unknown node TT")));
  EXPECT_THAT(error("[S, T, C]", "[Z]", "C"), AllOf(StartsWith(":10: "), HasSubstr("unknown node Z")));
  EXPECT_THAT(error("[S, T, C]", "[S]", "Z"), AllOf(StartsWith(":11: "), HasSubstr("unknown node Z")));
  EXPECT_THAT(error("[S, T, C]", "[]", "C"), AllOf(StartsWith(":10: "), HasSubstr("empty list")));
  EXPECT_THAT(error("[S, T, C]", "[T]", "C"), AllOf(StartsWith(":10: "), HasSubstr("has no timer")));
  EXPECT_THAT(error("[S, T, C, Other]", "[S, Other]", "C"),
              AllOf(StartsWith(":10: "), HasSubstr("cannot be reached from source Other")));
  EXPECT_THAT(error("[S, C]", "[S]", "C"), HasSubstr("cannot be reached"));  // the path leads through T
  EXPECT_THAT(error("[S, T]", "[S]", "C"), AllOf(StartsWith(":11: "), HasSubstr("missing in `nodes`")));
  EXPECT_THAT(error("[S, T, T, C]", "[S]", "C"), AllOf(StartsWith(":9: "), HasSubstr("twice")));
}

TEST_F(GraphFile, NoChainBeginsWithASampleThatWaitsForASet) {
  const auto error = [&](const std::string& source) {
    return error_of_nodes(
        kSensor + "- {name: B, type: sensor, period_ms: 5}\n- {name: F, type: fusion, inputs: [S, B]}\n" +
        "- {name: C, type: command, input: F}\nchains:\n- {name: c, nodes: [" + source + ", C], sources: [" +
        source + "], sink: C}\n");
  };
  EXPECT_THAT(error("F/S"), AllOf(StartsWith(":8: "), HasSubstr("source F/S"), HasSubstr("begin with")));
  EXPECT_THAT(error("F/B"), AllOf(StartsWith(":8: "), HasSubstr("source F/B"), HasSubstr("begin with")));
}

}  // namespace
}  // namespace hotpath
