// SPDX-License-Identifier: Apache-2.0
// Graphs from descriptions in CARET's words: who publishes what how often, and which paths are
// chains.
#include <gmock/gmock.h>

#include "import/caret_drafts.hpp"
#include "import/import_caret.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

imports::CaretCallback timer(const std::string& name, Duration period) { return {name, {}, period}; }
imports::CaretCallback subscription(const std::string& name, const std::string& topic) {
  return {name, topic, {}};
}

/// A sensor whose timer publishes /a.
imports::CaretNode sensor() {
  return {"/sensor", {timer("/sensor/t", 50ms)}, {}, {{"/a", {"/sensor/t"}}}, {}};
}

imports::CaretStats measured(Duration period) { return {period, {}}; }

const Callback& callback_of(const imports::ImportedGraph& imported, const std::string& task) {
  const GraphTasks tasks = make_tasks(imported.graph);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin& origin = tasks.origin[id];
    if (tasks.set[id].name == task) return imported.graph.nodes[origin.node].callbacks[origin.callback];
  }
  throw std::out_of_range("no task " + task);
}

TEST(Caret, ATopicHasTheFrequencyOfItsFastestSubscriber) {
  imports::CaretArchitecture all;
  all.nodes = {{"/fast", {subscription("/fast/c", "/a")}, {}, {}, {}},
               {"/slow", {subscription("/slow/c", "/a")}, {}, {}, {}}};
  const std::map<std::string, imports::CaretStats> stats = {{"/fast/c", measured(100ms)},
                                                            {"/slow/c", measured(200ms)}};
  const imports::CaretDrafts drafts = imports::make_drafts(all, stats);
  EXPECT_DOUBLE_EQ(drafts.frequency("/a"), 10);
  EXPECT_EQ(drafts.frequency("/b"), 0);
}

TEST(Caret, ASecondSubscriptionOfANodeToATopicIsLeftOut) {
  imports::CaretArchitecture all;
  all.nodes = {{"/n", {subscription("/n/c", "/a"), subscription("/n/d", "/a")}, {}, {}, {}},
               {"/m", {subscription("/m/c", "/a")}, {}, {}, {}}};
  const imports::CaretDrafts drafts = imports::make_drafts(all, {});
  EXPECT_EQ(drafts.twice, 1U);
  EXPECT_EQ(drafts.all.size(), 2U);
}

TEST(Caret, ACallbackPublishesWithSoManyJobsThatTheFrequenciesFit) {
  for (const auto& [reader, every] : {std::pair(100ms, 2U), std::pair(88ms, 2U), std::pair(150ms, 3U)}) {
    imports::CaretArchitecture all;
    all.nodes = {sensor(), {"/reader", {subscription("/reader/c", "/a")}, {}, {}, {}}};
    const auto imported =
        imports::graph_of(all, {{"/sensor/t", measured(50ms)}, {"/reader/c", measured(reader)}});
    const Publication& p = callback_of(imported, "sensor/t").publishes.at(0);
    EXPECT_EQ(p.rule, PublishRule::every);
    EXPECT_EQ(p.n, every);
  }
}

TEST(Caret, OnlyTimersUseTheNewestSamplesOfMessageContexts) {
  imports::CaretArchitecture all;
  all.nodes = {
      sensor(),
      {"/n", {subscription("/n/a", "/a"), timer("/n/t", 20ms)}, {}, {{"/b", {"/n/t"}}}, {{"/a", "/b"}}},
      {"/m",
       {subscription("/m/a", "/a"), subscription("/m/b", "/b")},
       {},
       {{"/c", {"/m/b"}}},
       {{"/a", "/c"}}}};
  const auto imported = imports::graph_of(all, {});
  const Publication& of_timer = callback_of(imported, "n/t").publishes.at(0);
  EXPECT_EQ(of_timer.rule, PublishRule::last_of);
  EXPECT_THAT(of_timer.of, ElementsAre(0));
  EXPECT_EQ(callback_of(imported, "m/b").publishes.at(0).rule, PublishRule::always);
}

TEST(Caret, PublicationsOfNamedPathsAreAssignedFirst) {
  // Each of the two would close a cycle if the other one is assigned before.
  imports::CaretArchitecture all;
  all.nodes = {{"/p", {subscription("/p/c", "/q")}, {}, {{"/p", {}}}, {}},
               {"/q", {subscription("/q/c", "/p")}, {}, {{"/q", {}}}, {}}};
  const auto unassigned = [&](const imports::CaretSteps& on_path) {
    imports::CaretDrafts drafts = imports::make_drafts(all, {});
    imports::assign_publications(all, on_path, false, drafts);
    EXPECT_EQ(drafts.cycles, 1U);
    return drafts.unassigned;
  };
  EXPECT_THAT(unassigned({}), ElementsAre("q"));
  EXPECT_THAT(unassigned({{"/q", "/p", "/q"}}), ElementsAre("p"));
}

TEST(Caret, MultiThreadedExecutorsHaveTwoToFourThreads) {
  imports::CaretArchitecture all;
  all.nodes = {sensor()};
  all.nodes[0].groups = {{"/g", CallbackGroup::mutually_exclusive, {"/sensor/t"}}};
  const auto executor = [&](bool several, const std::vector<std::string>& groups) {
    all.executors = {{"e", several, groups}};
    return imports::graph_of(all, {}).deployment.executors.at(0).executor;
  };
  EXPECT_EQ(executor(true, {"/g"}), "multi:2");
  EXPECT_EQ(executor(true, {"/g", "/h", "/i"}), "multi:3");
  EXPECT_EQ(executor(true, {"/g", "/h", "/i", "/j", "/k"}), "multi:4");
  EXPECT_EQ(executor(false, {"/g", "/h"}), "default");
}

TEST(Caret, APathThatEndsInAStoredSampleEndsInTheTaskThatUsesIt) {
  imports::CaretArchitecture all;
  all.nodes = {
      sensor(),
      {"/n", {subscription("/n/a", "/a"), timer("/n/t", 20ms)}, {}, {{"/b", {"/n/t"}}}, {{"/a", "/b"}}}};
  all.paths = {{"path", {{"/sensor", "", "/a"}, {"/n", "/a", ""}}}};
  const auto imported = imports::graph_of(all, {});
  ASSERT_EQ(imported.graph.chains.size(), 1U);
  EXPECT_THAT(imported.graph.chains[0].nodes, ElementsAre("sensor/t", "n/a", "n/t"));
  EXPECT_EQ(imported.graph.chains[0].sink, "n/t");
}

TEST(Caret, APathWithoutAFlowOfDataIsNoChain) {
  imports::CaretArchitecture all;
  all.nodes = {sensor(),
               {"/other", {timer("/other/t", 20ms)}, {}, {{"/c", {"/other/t"}}}, {}},
               {"/n", {subscription("/n/c", "/c")}, {}, {}, {}}};
  all.paths = {{"path", {{"/sensor", "", "/a"}, {"/n", "/c", ""}}}};
  const auto imported = imports::graph_of(all, {});
  EXPECT_THAT(imported.graph.chains, IsEmpty());
  EXPECT_THAT(imported.missing,
              testing::Contains(HasSubstr("data of sensor/t does not reach the messages of n/c")));
}

}  // namespace
}  // namespace hotpath
