// SPDX-License-Identifier: Apache-2.0
// The graph of a recorded system: its callback groups, names, services, cycles and gaps.
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <tuple>

#include "program/errors.hpp"
#include "recorded.hpp"
#include "reference_nodes.hpp"

namespace hotpath::recorded_graph_test {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;
using K = tracing::CallbackKind;

TEST(RecordedGraph, OnlyJobsOfTwoThreadsOverlap) {
  for (const auto& [thread, start, groups] :
       {std::tuple(0U, 2ms, 1U), std::tuple(1U, 2ms, 2U), std::tuple(1U, 10ms, 1U)}) {
    RecordedCallbacks r;
    r.callback(K::timer);
    r.callback(K::timer);
    r.job(0, 0, 0ms, 10ms);
    r.job(1, thread, start, start + 2ms);
    EXPECT_EQ(r.graph().graph.nodes.at(0).groups.size(), groups) << thread << " from " << start.count();
  }
}

TEST(RecordedGraph, RequestsComeFromOutsideAtTheirInstants) {
  for (const auto& [kind, entity] :
       {std::pair(K::service, EntityKind::service), std::pair(K::client, EntityKind::client),
        std::pair(K::unannounced, EntityKind::waitable)}) {
    RecordedCallbacks r;
    r.system.topics = {{"/service", {}}};
    r.callback(K::timer);
    r.callback(kind, 0, 0);
    r.job(0, 0, 0ms, 1ms);
    for (const Duration at : {10ms, 20ms, 30ms}) {
      tracing::Job& job = r.job(1, 0, at, at + 1us);
      job.has_sample = true;
      job.sample.published = job.start;
    }
    const imports::RecordedGraph graph = r.graph();
    EXPECT_EQ(graph.tasks.set[graph.task_of.at(1)].entity, entity);
    const Node& outside = graph.graph.nodes.at(1);
    EXPECT_EQ(outside.name, imports::kOutside);
    ASSERT_EQ(outside.callbacks.size(), 1U);
    EXPECT_EQ(outside.callbacks[0].period, 10ms);
    EXPECT_EQ(outside.callbacks[0].phase, Duration(10ms));
    const imports::RecordedGraph without = r.graph({1});
    EXPECT_EQ(without.task_of.at(1), kNoTask) << "threads of no executor";
    EXPECT_THAT(without.remarks.at(imports::Remark::missing),
                Contains(HasSubstr("1 callbacks of services and clients with 3 jobs ran on threads")));
  }
}

using Instants = std::function<Duration(int)>;

imports::OutsideReleases outside(int number, const Instants& at, Duration length) {
  std::vector<Time> all;
  all.reserve(static_cast<std::size_t>(number));
  for (int i = 0; i < number; ++i) all.push_back(Time{} + at(i));
  return imports::outside_releases(all, Time{}, Time{} + length);
}

Duration bursts_of_five(int i) { return i / 5 * 500ms + i % 5 * 1ms; }

TEST(OutsideReleases, AreOneTimerOrOneForEachArrival) {
  const Instants regular = [](int i) { return i * 100ms; }, late = [](int i) { return 40s + i * 100ms; };
  const Instants irregular = [](int i) { return 10ms * (i + 1) * (i + 1); };
  const Instants burst = [](int i) { return 1s + i * 1ms; };
  const Instants two_bursts = [](int i) { return i < 250 ? i * 1us : 10s + i * 1us; };
  struct Case {
    const char* name;
    int arrivals;
    Instants at;
    Duration length;
    std::size_t timers;
    Duration period;
  };
  for (const Case& c : std::vector<Case>{
           {"regular", 200, regular, 35s, 1, 100ms},
           {"regular and late", 200, late, 60s, 1, 100ms},
           {"one", 1, irregular, 1s, 1, 1h},
           {"few and irregular", 9, irregular, 1s, 9, 1h},
           {"a short burst", 3, burst, 60s, 3, 1h},
           {"a burst does not recur within the recording", 12, burst, 60s, 12, 60s},
           {"a long burst has its mean rate", 500, burst, 60s, 1, 120ms},
           {"bursts that go on", 20, bursts_of_five, 1505ms, 20, Duration(1504ms) / 19 * 20},
           {"bursts that ended", 20, bursts_of_five, 10s, 20, 10s},
           {"too many at once", 500, two_bursts, 10s, 1, Duration(10s + 499us) / 499},
       }) {
    const imports::OutsideReleases releases = outside(c.arrivals, c.at, c.length);
    ASSERT_THAT(releases, testing::FieldsAre(testing::SizeIs(c.timers), c.period, 0ms, testing::_)) << c.name;
    for (int i = 0; i < static_cast<int>(c.timers); ++i)
      EXPECT_EQ(releases.first[static_cast<std::size_t>(i)] - Time{}, c.at(i)) << c.name;
  }
}

/// The timers of very many arrivals take turns; every arrival is within the jitter of its turn.
TEST(OutsideReleases, JitterCoversVeryManyArrivals) {
  const imports::OutsideReleases releases = outside(500, bursts_of_five, 50s);
  const auto timers = static_cast<int>(releases.first.size());
  ASSERT_LE(timers, 10);
  EXPECT_LT(releases.jitter, releases.period);
  for (int i = 0; i < 500; ++i) {
    const Time turn = releases.first[static_cast<std::size_t>(i % timers)] + releases.period * (i / timers);
    const Duration late = Time{} + bursts_of_five(i) - turn;
    EXPECT_TRUE(late >= 0ms && late <= releases.jitter) << i;
  }
  const imports::OutsideReleases one = outside(
      200, [](int i) { return i * 10ms + i % 2 * 2ms; }, 2s);
  EXPECT_THAT(one.timers, testing::MatchesRegex("a timer of 10.0 ms with a release jitter of .*"));
}

/// A node has two subscriptions to a topic, of which the second one reads a copy. The names that the graph
/// would make are those of other topics, of a service and of a node.
TEST(RecordedGraph, NamesAreDifferent) {
  RecordedCallbacks r;
  r.system.topics = {{"/a", {}}, {"/a", {}}, {"/a_2", {}}, {"/timer", {}}, {"/strange", {}}};
  r.callback(K::timer);
  r.callback(K::service, 1, 0);
  for (const std::uint32_t topic : {1U, 1U, 2U, 3U}) r.callback(K::subscription, 1, topic);
  r.callback(K::timer, 1);
  r.callback(K::subscription, 2, 4);
  r.system.nodes[2] = "/outside";
  for (int i = 0; i < 10; ++i) {
    tracing::Job& job = r.job(0, 0, i * 10ms, i * 10ms + 1ms);
    for (const std::uint32_t topic : {1U, 2U, 3U}) job.published.push_back({topic, job.finish});
    for (std::uint32_t c = 1; c < 8; ++c) r.job(c, 0, i * 10ms + c * 1ms, i * 10ms + c * 1ms + 500us);
  }
  const imports::RecordedGraph graph = r.graph();
  std::vector<std::string> names, fed;
  for (const Task& task : graph.tasks.set.tasks) names.push_back(task.name);
  EXPECT_THAT(names,
              UnorderedElementsAre("n0/timer", "n1/a_3", "n1/a", "n1/a_2_2", "n1/a_2", "n1/timer",
                                   "n1/timer_2", "outside_2/strange", "outside/a_3", "outside/strange"));
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(4)].name, "n1/a_2") << "a topic keeps its name before copies";
  for (const TaskId id : graph.tasks.set[graph.task_of.at(0)].feeds) fed.push_back(graph.tasks.set[id].name);
  EXPECT_THAT(fed, UnorderedElementsAre("n1/a", "n1/a_2_2", "n1/a_2", "n1/timer"));
}

/// Nobody publishes the first topic, so that the second one has its name without a note.
TEST(RecordedGraph, TopicsOutsideOfTheGraphTakeNoNames) {
  RecordedCallbacks r;
  r.system.topics = {{"/a", {}}, {"/a", {}}};
  r.callback(K::timer);
  for (const std::uint32_t topic : {0U, 0U, 1U}) r.callback(K::subscription, 1, topic);
  for (int i = 0; i < 10; ++i) {
    r.job(0, 0, i * 10ms, i * 10ms + 1ms).published.push_back({1, Time{} + i * 10ms});
    r.job(3, 0, i * 10ms + 2ms, i * 10ms + 3ms);
  }
  const imports::RecordedGraph graph = r.graph();
  EXPECT_EQ(graph.tasks.set[graph.task_of.at(3)].name, "n1/a");
  EXPECT_THAT(graph.remarks.at(imports::Remark::missing), testing::Each(HasSubstr("Nobody published /a")));
}

/// Two nodes answer each other; the second one ran less often.
TEST(RecordedGraph, ACycleIsCutBeforeTheCallbackWithTheFewestJobs) {
  RecordedCallbacks r;
  r.system.topics = {{"/a", {}}, {"/b", {}}};
  r.callback(K::subscription, 0, 0);
  r.callback(K::subscription, 1, 1);
  for (int i = 0; i < 10; ++i) {
    r.job(0, 0, i * 10ms, i * 10ms + 1ms).published.push_back({1, Time{} + i * 10ms});
    if (i % 2 == 0)
      r.job(1, 0, i * 10ms + 2ms, i * 10ms + 3ms).published.push_back({0, Time{} + i * 10ms + 2ms});
  }
  const imports::RecordedGraph graph = r.graph();
  EXPECT_THAT(graph.remarks.at(imports::Remark::missing),
              Contains(HasSubstr("n0/a does not publish b in the graph")));
  // b keeps its samples.
  const Node& outside = graph.graph.nodes.back();
  EXPECT_EQ(outside.name, "outside");
  EXPECT_EQ(outside.callbacks.at(0).publishes.at(0).topic, "b");
}

/// Nodes with subscriptions to /x and /y; callback c is task c.
class Unmodelled : public testing::Test {
 protected:
  Unmodelled() {
    r_.system.topics = {{"/x", {}}, {"/y", {}}, {"/out", {}}};
    for (std::uint32_t c = 0; c < 4; ++c) {
      r_.callback(K::subscription, c / 2, c % 2).symbol = "_ZN4Node8receivedEv";
      graph_.task_of.push_back(c);
    }
  }
  std::vector<std::string> unmodelled() const { return imports::unmodelled(r_.system, graph_); }

  RecordedCallbacks r_;
  imports::RecordedGraph graph_;
};

TEST_F(Unmodelled, SynchronisersOfTheGraphAreNamedByNodeWithTheirTopics) {
  for (const std::size_t c : {0U, 1U, 2U})
    r_.system.callbacks[c].symbol = "message_filters::Subscriber<Image>::callback";
  EXPECT_THAT(unmodelled(), ElementsAre(HasSubstr("Node /n0 passes /x, /y through message_filters"),
                                        HasSubstr("Node /n1 passes /x through message_filters")));
  // The job of each /y publishes with the /y before the last one, and the /x before that.
  for (int i = 0; i < 60; ++i) {
    for (const Duration at : {0ms, 20ms})
      r_.job(0, 0, i * 40ms + at + 3ms, {}).sample.published += i * 40ms + at;
    tracing::Job& y = r_.job(1, 0, i * 40ms + 30ms, {});
    y.sample.published = y.start;
    if (i >= 2) y.published.push_back({2, y.start + 1ms});
  }
  graph_.tasks.set.tasks.resize(4);
  graph_.tasks.set.tasks[1].name = "n0/y";
  graph_.graph.chains = {{"c", {"n0/y"}, {}, "n0/y"}};
  EXPECT_THAT(imports::synchronised_chains({.jobs = r_.jobs, .system = r_.system}, graph_).at("c"),
              HasSubstr("(node /n0): it held messages for 11.0 ms (median) or longer, or 91.0 ms if"));
  for (const std::size_t c : {0U, 1U, 2U}) graph_.task_of[c] = kNoTask;
  EXPECT_THAT(unmodelled(), IsEmpty());
}

TEST_F(Unmodelled, ATopicThatNoRuleDescribesIsNamedWithTheBestOne) {
  graph_.rules = {{.topic = 2, .publishers = {2}, .jobs = 100, .explained = 95}};
  EXPECT_THAT(unmodelled(), IsEmpty());
  graph_.rules[0].explained = 94;
  EXPECT_THAT(unmodelled(), ElementsAre(AllOf(HasSubstr("topic /out: "), HasSubstr("94 of 100 jobs of /n1"),
                                              HasSubstr("lifecycle node"))));
}

/// S -> F -> C, and T, whose data goes nowhere.
Chain chain_of(const std::string& option) {
  Graph graph;
  graph.nodes = {reference_node("S", NodeType::sensor, {}, 10ms),
                 reference_node("T", NodeType::sensor, {}, 10ms),
                 reference_node("F", NodeType::transform, {{"S", 1, {}}}),
                 reference_node("C", NodeType::command, {{"F", 1, {}}})};
  return imports::chain_of(option, graph, make_tasks(graph));
}

TEST(ChainOption, ConsistsOfTheTasksBetweenSourceAndSink) {
  const Chain expected = {"C", {"S", "F/S", "C/F"}, {"S"}, "C/F"};
  EXPECT_EQ(chain_of("S:C"), expected);
  EXPECT_EQ(chain_of("S:C/F").name, "C.F");
}

TEST(ChainOption, BeginsAtTimersWhoseDataReachesTheSink) {
  for (const auto& [option, error] :
       {std::pair("F:C", "F is not a timer"), std::pair("S,T:C", "no data flows from T to C"),
        std::pair("C", "is not SOURCE"), std::pair("S:D", "D is not a node or task")})
    EXPECT_THAT([option = option] { chain_of(option); },
                testing::ThrowsMessage<program::UsageError>(HasSubstr(error)));
}

}  // namespace hotpath::recorded_graph_test
