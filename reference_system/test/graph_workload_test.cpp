// SPDX-License-Identifier: Apache-2.0
// Nodes in virtual time: ages of data. bench/test/independent/ checks the node types and orders of delivery,
// simulate_test.py Autoware beside the real ROS 2 stack at the same phases.
#include "hotpath/reference_system/graph_workload.hpp"

#include <gtest/gtest.h>

#include "graph_fixture.hpp"
#include "simulated_graph.hpp"

namespace hotpath::graph_workload_test {

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
  ChainJoin join(index_chains(g, tasks), tasks.set.size());
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
  Graph unread = g;
  unread.nodes.pop_back();
  const Simulated s = simulate_graph(unread, "events-ro", 300ms, {0ms, 10ms});
  EXPECT_EQ(std::ssize(working_jobs(s.tasks, s.trace).jobs),
            std::ranges::count(s.trace.jobs, Outcome::ran, &JobRecord::outcome))
      << "no reader shows which jobs published";
}

}  // namespace hotpath::graph_workload_test
