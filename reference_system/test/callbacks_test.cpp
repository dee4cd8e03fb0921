// SPDX-License-Identifier: Apache-2.0
// Nodes of type `callbacks` in virtual time: cases by hand for what bench/test/independent/ does not draw.
#include <gmock/gmock.h>

#include <map>

#include "graph_fixture.hpp"
#include "simulated_graph.hpp"

namespace hotpath::callbacks_test {

using namespace std::chrono_literals;
using testing::ElementsAre;

Graph graph_of(const std::string& nodes) { return load("name: g\nnodes:\n" + nodes); }
Simulated simulate_text(const std::string& nodes, Duration duration) {
  return simulate_graph(graph_of(nodes), "events-ro", duration);
}

/// A node of type `callbacks` with these callbacks.
std::string node_of(const std::string& name, const std::vector<std::string>& callbacks) {
  std::string text = "  - name: " + name + "\n    type: callbacks\n    callbacks:\n";
  for (const std::string& callback : callbacks) text += "      - {" + callback + "}\n";
  return text;
}
std::string sensor(const std::string& name, int period_ms) {
  return "  - {name: " + name + ", type: sensor, period_ms: " + std::to_string(period_ms) + "}\n";
}
std::string command(const std::string& name, const std::string& input) {
  return "  - {name: " + name + ", type: command, input: " + input + "}\n";
}
std::string chain(const std::string& nodes, const std::string& sources, const std::string& sink) {
  return "chains:\n  - {name: c, nodes: [" + nodes + "], sources: [" + sources + "], sink: " + sink + "}\n";
}

struct RuleCase {
  const char* what;
  std::string nodes;
  std::map<std::string, std::vector<double>> starts;  ///< By task, in milliseconds.
};

TEST(Callbacks, PublishByTheirRules) {
  const std::string both = "publishes: {topic: both, when: all_new, of: ";
  const std::string early = ", execution_time_ms: 4, " + both + "[P, Q], at_percent: 25}";
  const std::vector<RuleCase> cases = {
      {"one in three jobs, from the first one on",
       node_of("A", {"timer: t, period_ms: 10, publishes: {topic: x, every: 3, first: 1}"}) +
           command("C", "x"),
       {{"C/x", {0, 30}}}},
      {"a set within the job that completes it",
       sensor("P", 30) + sensor("Q", 30) +
           node_of("F", {"subscription: P" + early, "subscription: Q" + early}) + command("C", "both"),
       {{"C/both", {4, 34}}}},
      {"the last arrival completes a set, and only its job takes time; sets are separate",
       sensor("P", 10) + sensor("Q", 30) +
           node_of("F", {"subscription: P, execution_time_ms: 2, " + both + "[P, Q]}",
                         "subscription: Q, execution_time_ms: 2, " + both + "[Q, P]}",
                         "timer: t, period_ms: 45, publishes: {topic: late, when: all_new, of: [P]}"}) +
           command("C", "both") + command("L", "late"),
       {{"F/P", {0, 10, 20, 30, 40, 50}}, {"C/both", {2, 32}}, {"L/late", {45}}}},
  };
  for (const RuleCase& c : cases) {
    const Simulated s = simulate_text(c.nodes, 60ms);
    for (const auto& [task, starts] : c.starts) EXPECT_EQ(s.starts(task), starts) << c.what << ": " << task;
  }
}

/// A takes S's samples 0, 2, 4 and 7, and publishes with the second and the fourth.
TEST(Callbacks, AMessageCountsTheLossesSinceTheOneBefore) {
  const std::string every =
      node_of("A", {"subscription: S, execution_time_ms: 24, publishes: {topic: a, every: 2}"});
  const Simulated s =
      simulate_text(sensor("S", 10) + every + command("C", "a") + chain("S, A, C", "S", "C"), 100ms);
  ASSERT_EQ(s.trace.chains.size(), 2U);
  EXPECT_EQ(s.trace.chains[1].dropped, 3U);
  const std::string cyclic = "  - {name: N, type: cyclic, period_ms: 30, inputs: [S]}\n" + command("C", "N");
  const std::string nodes = sensor("S", 10) + cyclic + chain("S, N, C", "S", "C");
  EXPECT_EQ(simulate_text(nodes, 100ms).trace.chains.at(1).dropped, 2U);
}

/// A works from 0 to 10 ms and publishes x after 2 ms, y after 6.5 ms and z at its end.
TEST(Callbacks, AJobPublishesAtSeveralInstantsBeforeItsEnd) {
  Graph g =
      graph_of(node_of("A", {"timer: t, period_ms: 20, execution_time_ms: 10, publishes: [{topic: z, "
                             "at_percent: 100}, {topic: y, at_percent: 65}, {topic: x, at_percent: 20}]"}) +
               command("X", "x") + command("Y", "y") + command("Z", "z"));
  const Simulated one = simulate_graph(g, "events-ro", 20ms);
  EXPECT_THAT(one.starts("X/x"), ElementsAre(10)) << "the only thread is busy";
  std::map<std::string, Time> published;
  for (const JobRecord& r : one.trace.jobs)
    published.emplace(one.tasks.set[r.job.task].name, r.job.timestamp);
  EXPECT_EQ(published.at("X/x"), Time{} + 2ms);
  EXPECT_EQ(published.at("Y/y"), Time{} + 6500us);
  EXPECT_EQ(published.at("Z/z"), Time{} + 10ms);
  g.platform.cores = 2;
  const Simulated two = simulate_graph(g, "multi", 20ms, {}, {.workers = 2});
  EXPECT_THAT(two.starts("X/x"), ElementsAre(2));
  EXPECT_THAT(two.starts("Z/z"), ElementsAre(10));
}

TEST(Callbacks, EachMessageOfAJobHasTheDataOfItsOwnSet) {
  const std::string both =
      "timer: t, period_ms: 10, publishes: "
      "[{topic: p, when: all_new, of: [P]}, {topic: q, when: all_new, of: [Q]}]";
  const Simulated s = simulate_text(sensor("P", 10) + sensor("Q", 10) +
                                        node_of("F", {"subscription: P", "subscription: Q", both}) +
                                        command("C", "p") + command("D", "q") + chain("P, F, D", "P", "D") +
                                        "  - {name: own, nodes: [P, F, C], sources: [P], sink: C}\n",
                                    50ms);
  EXPECT_FALSE(s.trace.chains.empty());
  for (const ChainRecord& c : s.trace.chains) EXPECT_EQ(c.chain, 1U) << "P's data is not in q";
}

TEST(Callbacks, ChainsBeginAtTheTimerThatTheyName) {
  const Graph g = graph_of(
      node_of("D", {"timer: slow, period_ms: 40, execution_time_ms: 3, publishes: {topic: x, every: 2}",
                    "timer: fast, period_ms: 10, execution_time_ms: 1, publishes: y"}) +
      node_of("C", {"subscription: x, execution_time_ms: 1", "subscription: y, execution_time_ms: 1"}) +
      chain("D/slow, C/x", "D/slow", "C/x"));
  const Simulated s = simulate_graph(g, "rm-ro", 100ms);
  // The second slow job: its timestamp is 40 ms, and the fast timer's job runs before it.
  ASSERT_EQ(s.trace.chains.size(), 1U);
  EXPECT_EQ(to_ms(s.trace.chains[0].hot_path_latency), s.starts("C/x")[0] - s.starts("D/slow")[1]);
  EXPECT_EQ(to_ms(s.trace.chains[0].end_to_end_latency), s.starts("C/x")[0] + 1 - 40);
}

TEST(Callbacks, ChainsMayBeginAtASubscription) {
  const Simulated s = simulate_text(
      "  - {name: S, type: sensor, period_ms: 10, execution_time_ms: 2}\n" +
          node_of("A", {"subscription: S, execution_time_ms: 3, publishes: x"}) +
          "  - {name: C, type: command, input: x, execution_time_ms: 1}\n" + chain("A/S, C", "A/S", "C"),
      95ms);
  ASSERT_EQ(s.trace.chains.size(), 9U);
  for (const ChainRecord& c : s.trace.chains) {
    EXPECT_EQ(c.hot_path_latency, 3ms);
    EXPECT_EQ(c.end_to_end_latency, 4ms);  // from the publication of the sensor's sample
  }
}

TEST(Callbacks, ATimersMessageMayReturnToItAndItsOldEntryIsRemoved) {
  const std::string timer =
      "timer: t, period_ms: 10, execution_time_ms: 1, publishes: {topic: a, last_of: [b]}";
  const Simulated s =
      simulate_text(node_of("A", {"subscription: b", timer}) +
                        node_of("B", {"subscription: a, execution_time_ms: 2, publishes: b"}) +
                        chain("A/t, B/a", "A/t", "B/a"),
                    95ms);
  ASSERT_EQ(s.trace.chains.size(), 10U);
  for (const ChainRecord& c : s.trace.chains) EXPECT_EQ(c.hot_path_latency, 1ms);
}

TEST(Callbacks, NamesMayBeLong) {
  const std::string name(200, 'n'), timer(200, 't');
  const Simulated s = simulate_text(node_of(name, {"timer: " + timer + ", period_ms: 10, publishes: x"}) +
                                        node_of("C", {"subscription: x"}),
                                    30ms);
  EXPECT_EQ(s.starts(name + "/" + timer).size(), 3U);
  EXPECT_EQ(s.starts("C/x").size(), 3U);
}

TEST(Callbacks, MessagesRememberAHundredNodes) {
  // Two branches of fifty nodes each meet in one node; its message contains the histories of both.
  std::string nodes, names;
  for (const std::string branch : {"A", "B"}) {
    for (int i = 0; i < 50; ++i) {
      const std::string name = branch + std::to_string(i), before = branch + std::to_string(i - 1);
      std::string keys = i == 0 ? "timer: t, period_ms: 100" : "subscription: " + before;
      nodes += node_of(name, {keys.append(", execution_time_ms: 0.1, publishes: ").append(name)});
      names += name + ", ";
    }
  }
  const std::string set = ", publishes: {topic: f, when: all_new, of: [A49, B49]}";
  nodes += node_of("F", {"subscription: A49" + set, "subscription: B49" + set}) + command("C", "f");
  const Simulated s = simulate_text(nodes + chain(names + "F, C", "A0, B0", "C"), 250ms);
  ASSERT_EQ(s.observations.size(), 3U);
  for (const ChainObservation& o : s.observations) EXPECT_EQ(o.sources_seen, 3U);
  EXPECT_EQ(s.trace.chains[2].end_to_end_latency, 10ms);
}

TEST(Callbacks, MeasuredTimesAreDrawnUniformlyFromTheGivenValues) {
  const GraphTasks tasks =
      make_tasks(graph_of(node_of("A", {"timer: t, period_ms: 10, execution_time_ms: {measured: [1, 2, 4]}",
                                        "timer: u, period_ms: 10, execution_time_ms: {min: 1, max: 2}"})));
  EXPECT_EQ(tasks.set[0].wcet, 4ms);
  EXPECT_EQ(tasks.set[0].bcet, 1ms);
  const MeasuredTimes times(tasks.set, {tasks.callbacks[0].measured, nullptr}, 7);
  const MeasuredTimes again(tasks.set, {tasks.callbacks[0].measured, nullptr}, 7);
  const UniformTimes uniform(tasks.set, 7);
  std::map<Duration, int> count;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    Job job;
    job.task = 0;
    job.sequence = i;
    ++count[times.of(job)];
    EXPECT_EQ(times.of(job), again.of(job));
    job.task = 1;
    EXPECT_EQ(times.of(job), uniform.of(job)) << "without measured values";
  }
  EXPECT_EQ(count.size(), 3U);
  for (const Duration d : {1ms, 2ms, 4ms}) EXPECT_NEAR(count[d], 1000, 150);
}

}  // namespace hotpath::callbacks_test
