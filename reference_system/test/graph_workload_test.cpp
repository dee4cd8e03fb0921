// SPDX-License-Identifier: Apache-2.0
// Nodes in virtual time: ages of data, and Autoware beside the real ROS 2 stack at the same phases.
// bench/test/independent/ checks the node types and orders of delivery.
#include "hotpath/reference_system/graph_workload.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "simulated_graph.hpp"

namespace hotpath::graph_workload_test {
namespace {

using namespace std::chrono_literals;

Time at(Duration d) { return Time{} + d; }

/// Data of S reaches F at once, and by way of N, whether the chain names N or not.
TEST(GraphWorkload, AgeCountsFromTheOldestJobOfASourceThatArrivesByTwoPaths) {
  // The job of N at 399 ms reads S's of 300 ms and ends at 401 ms; F then has S's of 400 ms as well.
  for (const std::string inputs : {"[S, N]", "[N, S]"}) {
    const Graph g = load(R"(
name: g
nodes:
- {name: S, type: sensor, period_ms: 100}
- {name: N, type: cyclic, period_ms: 400, inputs: [S], execution_time_ms: 2}
- {name: F, type: fusion, execution_time_ms: 2, inputs: )" +
                         inputs + R"(}
chains:
- {name: chain, nodes: [S, N, F], sources: [S], sink: F}
- {name: shorter, nodes: [S, F], sources: [S], sink: F}
)");
    const Simulated s = simulate_graph(g, "rm-ro", 500ms, {0ms, 0ms, 399ms});
    ASSERT_EQ(s.trace.chains.size(), 2U);
    for (const ChainRecord& output : s.trace.chains) {
      EXPECT_EQ(output.end_to_end_latency, 103ms);
      EXPECT_TRUE(output.chain != 0 || output.hot_path_latency == 101ms);
    }
  }
}

/// The planner P reads S and its own old output, which F feeds back, also if F reads S as well. The age along
/// the chain is that of S's last sample, whether F belongs to the chain or not.
TEST(GraphWorkload, AgeLeavesOutDataThatReturnsToTheChain) {
  const std::string behind = "transform, input: X", beside = "cyclic, period_ms: 100, inputs: [S, P]";
  for (const auto& [f, nodes] :
       {std::pair(behind, "[S, P, X]"), {behind, "[S, P, X, F]"}, {beside, "[S, P, X]"}}) {
    const Graph g = load(R"(
name: g
nodes:
- {name: S, type: sensor, period_ms: 100}
- {name: P, type: cyclic, period_ms: 100, inputs: [S, F], execution_time_ms: 1}
- {name: X, type: transform, input: P, execution_time_ms: 1}
- {name: F, execution_time_ms: 1, type: )" +
                         f + R"(}
chains:
- {name: chain, sources: [S], sink: X, nodes: )" +
                         nodes + "}\n");
    const Simulated s = simulate_graph(g, "rm-ro", 500ms, {0ms, 0ms, 0ms, 10ms});
    ASSERT_EQ(s.trace.chains.size(), 5U);
    for (const ChainRecord& output : s.trace.chains) EXPECT_EQ(output.end_to_end_latency, 12ms);
  }
}

/// Two sensors, a fusion with a timer, and its reader.
Graph fusion_graph() {
  return load(R"(
name: g
nodes:
- {name: P, type: sensor, period_ms: 30}
- {name: Q, type: sensor, period_ms: 30}
- {name: F, type: callbacks, callbacks: [{timer: t, period_ms: 100, execution_time_ms: 2, publishes: t},
    {subscription: P, execution_time_ms: 9, publishes: {topic: f, when: all_new, of: [P, Q]}},
    {subscription: Q, execution_time_ms: 9, publishes: {topic: f, when: all_new, of: [P, Q]}}]}
- {name: C, type: command, input: f}
chains:
- {name: chain, nodes: [P, Q, F], sources: [P, Q], sink: F}
)");
}

TEST(ChainJoin, KnowsNoEndToEndLatencyWithoutTheRecordsOfBothEnds) {
  const Graph g = fusion_graph();
  const GraphTasks tasks = make_tasks(g);
  const TaskId p = 0, q = 1, sink = 3;
  ChainJoin join(g, tasks);
  ChainObservation o;
  o.sink.task = sink;
  o.sources_seen = 3;
  o.names_jobs = true;
  const auto add = [&](TaskId task, Duration start, Outcome outcome) {
    JobRecord r;
    r.job.task = task;
    r.job.sequence = o.sink.sequence;
    r.job.timestamp = r.start = at(start);
    r.finish = at(start + 2ms);
    r.outcome = outcome;
    join.add(r);
  };
  add(p, 1ms, Outcome::ran);
  add(sink, 10ms, Outcome::ran);
  EXPECT_EQ(join.join(o).end_to_end_latency, Duration(-1)) << "no record of Q's job";
  add(q, 5ms, Outcome::ran);
  EXPECT_EQ(join.join(o).end_to_end_latency, 11ms);
  o.sink.sequence = 1;
  add(sink, 60ms, Outcome::running);
  EXPECT_EQ(join.join(o).end_to_end_latency, Duration(-1)) << "the sink's job has no end";
}

TEST(WorkingJobs, FusionsReplayTheTimesOfJobsThatPublished) {
  const Graph g = fusion_graph();
  const Simulated measured = simulate_graph(g, "events-ro", 300ms, {0ms, 10ms});
  const ReplayedTimes times(measured.tasks.set, working_jobs(measured.tasks, measured.trace));
  // Input P never completed a set in the trace; if it did, it would take the measured time of a
  // set.
  for (const TaskId fusion : {3U, 4U}) {
    Job job;
    job.task = fusion;
    job.sequence = 3;
    EXPECT_EQ(times.of(job), 9ms) << measured.tasks.set[fusion].name;
  }
}

struct Reference {
  const char* executor;
  double median_ms;
  double tolerance;
  unsigned cores;
  Duration dispatch_cost;
};
std::ostream& operator<<(std::ostream& out, const Reference& r) { return out << r.executor; }

class RclcppAutowarePhases : public testing::TestWithParam<Reference> {};

/// reference_system/ros2_reference/rclcpp_autoware_phases.csv: 4.22 ms per crunch, the creation
/// instants of the timers, 30 s per run without the first prints. Medians of the hot-path latency.
///
/// `rm-ro` and `edf-ro` are the fork's executors: subscriptions run before timers, and of two
/// subscriptions the earlier one in the fork's heap runs first. Dispatch costs are the times
/// between two jobs of the golden traces. `multi` has no golden trace: its cost is the hot path
/// without work (0.966 ms) divided by its seven callbacks.
TEST_P(RclcppAutowarePhases, MedianOfTheRealStack) {
  const Reference& reference = GetParam();
  Graph graph = load_graph(find_graph("autoware"));
  for (Node& node : graph.nodes)
    for (Callback& callback : node.callbacks)
      if (callback.worst > Duration{}) callback.worst = callback.best = 4220us;
  const auto phases = read_phases(std::string(HOTPATH_REFERENCE_DIR) + "/rclcpp_autoware_phases.csv", graph,
                                  reference.executor);
  graph.platform.cores = reference.cores;
  graph.platform.set_dispatch_costs(reference.dispatch_cost);
  const Simulated s =
      simulate_graph(graph, reference.executor, 30s, phases, {SubscriptionRule::first, Ties::fifo, 2});
  // The six outputs of a hyperperiod (600 ms) differ, for `events-ro` by a crunch on either side of
  // the median; therefore a whole number of hyperperiods is counted.
  std::vector<double> latencies;
  for (const ChainObservation& o : s.observations)
    if (o.sink_start >= at(1200ms)) latencies.push_back(to_ms(o.sink_start - o.latest_source_start));
  ASSERT_GT(latencies.size(), 250U);
  std::sort(latencies.begin(), latencies.end());
  const double median = (latencies[(latencies.size() - 1) / 2] + latencies[latencies.size() / 2]) / 2;
  RecordProperty("median_ms", std::to_string(median));
  EXPECT_NEAR(median / reference.median_ms, 1, reference.tolerance);
}

INSTANTIATE_TEST_SUITE_P(
    ReferenceCsv, RclcppAutowarePhases,
    testing::Values(Reference{"default", 35.408, 0.05, 1, 20us}, Reference{"static", 30.507, 0.05, 1, 7us},
                    Reference{"multi", 18.990, 0.10, 2, 138us}, Reference{"events-ro", 41.679, 0.05, 1, 1us},
                    Reference{"events-re", 42.399, 0.05, 1, 6us}, Reference{"rm-ro", 21.187, 0.05, 1, 1us},
                    Reference{"edf-ro", 21.371, 0.05, 1, 1us}));

}  // namespace
}  // namespace hotpath::graph_workload_test
