// SPDX-License-Identifier: Apache-2.0
// Nodes in virtual time: ages of data, orders of delivery, and Autoware beside the real ROS 2 stack at the
// same phases. bench/test/independent/ checks the node types.
#include "hotpath/reference_system/graph_workload.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hotpath/core/accounting.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "hotpath/reference_system/reference_node.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;

ReferenceNode sensor(const std::string& name, Duration period) {
  ReferenceNode n;
  n.name = name;
  n.type = NodeType::sensor;
  n.period = n.deadline = period;
  n.outputs = {name};
  return n;
}

ReferenceNode worker(const std::string& name, NodeType type, std::vector<std::string> inputs, Duration time,
                     Duration period = {}) {
  ReferenceNode n;
  n.name = name;
  n.type = type;
  for (std::string& topic : inputs) n.inputs.push_back({std::move(topic), 1, std::nullopt});
  if (type != NodeType::command) n.outputs = {name};
  n.period = period;
  n.execution_time = n.best_case_execution_time = time;
  return n;
}

struct Simulated {
  GraphTasks tasks;
  Trace trace;
  std::vector<ChainObservation> observations;
  std::vector<ChainRecord> chains;

  std::vector<const JobRecord*> ran(const std::string& task) const {
    std::vector<const JobRecord*> jobs;
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome == Outcome::ran && tasks.set[r.job.task].name == task) jobs.push_back(&r);
    }
    return jobs;
  }
};

/// `phases`: first timestamps of the timers, by task; missing ones are 0.
Simulated simulate_graph(const Graph& graph, const std::string& executor, Duration duration,
                         const std::vector<Duration>& phases = {}, const SchedulerOptions& scheduling = {},
                         Platform platform = {}) {
  Simulated s;
  s.tasks = make_tasks(graph);
  for (TaskId id = 0; id < phases.size(); ++id) s.tasks.set.tasks[id].phase = phases[id];
  const WorstCaseTimes times(s.tasks.set);
  GraphWorkload workload(graph, s.tasks, times, &s.observations);
  const ExecutorEntry& entry = *find_executor(executor);
  platform.raised_releaser = entry.traits.raises_timer_thread;
  SimulationOptions options;
  options.platform = platform;
  options.duration = duration;
  s.trace = simulate_trace(s.tasks.set, entry, scheduling, workload, options);
  s.chains = join_chains(graph, s.tasks, s.trace, s.observations);
  return s;
}

Time at(Duration d) { return Time{} + d; }

/// Samples reach B before A although A was created first. Executors that queue samples run B first,
/// those that prefer the latest activation among equals run A first, and wait sets do not see it.
TEST(GraphWorkload, OrderOfDeliveryDecidesBetweenSubscribersOfOneTopic) {
  Graph g;
  g.nodes = {sensor("S", 100ms), worker("A", NodeType::command, {"S"}, 3ms),
             worker("B", NodeType::command, {"S"}, 4ms)};
  const auto first = [&](const std::string& executor, const SchedulerOptions& options = {}) {
    const Simulated s = simulate_graph(g, executor, 1s, {}, options);
    return s.ran("A/S")[0]->start < s.ran("B/S")[0]->start ? "A" : "B";
  };
  const SchedulerOptions fifo{SubscriptionRule::inherit, Ties::fifo, 0};
  EXPECT_STREQ(first("events-ro"), "A");
  EXPECT_STREQ(first("rm-ro"), "B");
  EXPECT_STREQ(first("rm-ro", fifo), "A");
  g.delivery["S"].nodes = {"B", "A"};
  EXPECT_STREQ(first("events-ro"), "B");
  EXPECT_STREQ(first("cbg"), "B");
  EXPECT_STREQ(first("rm-ro"), "A");
  EXPECT_STREQ(first("edf-ro"), "A");
  EXPECT_STREQ(first("rm-ro", fifo), "B");
  EXPECT_STREQ(first("default"), "A");
  EXPECT_STREQ(first("static"), "A");
}

TEST(GraphWorkload, AgeCountsFromTheOldestJobOfASourceThatArrivesByTwoPaths) {
  // The job of N at 399 ms reads S's of 300 ms and ends at 401 ms; F then has S's of 400 ms as well.
  Graph g;
  g.nodes = {sensor("S", 100ms), worker("N", NodeType::cyclic, {"S"}, 2ms, 400ms),
             worker("F", NodeType::fusion, {"S", "N"}, 2ms)};
  g.chains = {{"chain", {"S", "N", "F"}, {"S"}, "F"}};
  for (const bool swapped : {false, true}) {
    if (swapped) g.nodes[2] = worker("F", NodeType::fusion, {"N", "S"}, 2ms);
    const Simulated s = simulate_graph(g, "rm-ro", 500ms, {0ms, 0ms, 399ms});
    ASSERT_EQ(s.chains.size(), 1U);
    EXPECT_EQ(s.chains[0].end_to_end_latency, 103ms);
    EXPECT_EQ(s.chains[0].hot_path_latency, 101ms);
  }
}

/// The planner P reads S and its own old output, which F feeds back. The age along the chain is that of
/// S's last sample, whether F belongs to the chain or not.
TEST(GraphWorkload, AgeLeavesOutDataThatReturnsToTheChain) {
  for (const bool with_feedback : {false, true}) {
    Graph g;
    g.nodes = {sensor("S", 100ms), worker("P", NodeType::cyclic, {"S", "F"}, 1ms, 100ms),
               worker("X", NodeType::transform, {"P"}, 1ms), worker("F", NodeType::transform, {"X"}, 1ms)};
    g.chains = {{"chain", {"S", "P", "X"}, {"S"}, "X"}};
    if (with_feedback) g.chains[0].nodes.emplace_back("F");
    const Simulated s = simulate_graph(g, "rm-ro", 500ms, {0ms, 0ms, 0ms, 10ms});
    ASSERT_EQ(s.chains.size(), 5U);
    for (const ChainRecord& output : s.chains) EXPECT_EQ(output.end_to_end_latency, 12ms);
  }
}

/// Data of S reaches F at once, and by way of N, whether the chain names N or not.
TEST(GraphWorkload, AgeCountsDataOfOtherPaths) {
  Graph g;
  g.nodes = {sensor("S", 100ms), worker("N", NodeType::cyclic, {"S"}, 2ms, 400ms),
             worker("F", NodeType::fusion, {"S", "N"}, 2ms)};
  g.chains = {{"chain", {"S", "F"}, {"S"}, "F"}, {"longer", {"S", "N", "F"}, {"S"}, "F"}};
  const Simulated s = simulate_graph(g, "rm-ro", 500ms, {0ms, 0ms, 399ms});
  ASSERT_EQ(s.chains.size(), 2U);
  for (const ChainRecord& output : s.chains) EXPECT_EQ(output.end_to_end_latency, 103ms);
}

TEST(ChainJoin, KnowsNoEndToEndLatencyWithoutTheRecordsOfBothEnds) {
  Graph g;
  g.nodes = {sensor("P", 50ms), sensor("Q", 50ms), worker("F", NodeType::fusion, {"P", "Q"}, 2ms)};
  g.chains = {{"chain", {"P", "Q", "F"}, {"P", "Q"}, "F"}};
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
  Graph g;
  g.nodes = {sensor("P", 30ms), sensor("Q", 30ms), worker("F", NodeType::fusion, {"P", "Q"}, 9ms),
             worker("C", NodeType::command, {"F"}, 0ms)};
  const Simulated measured = simulate_graph(g, "events-ro", 300ms, {0ms, 10ms});
  const ReplayedTimes times(measured.tasks.set, working_jobs(measured.tasks, measured.trace));
  // Input P never completed a set in the trace; if it did, it would take the measured time of a
  // set.
  for (const TaskId fusion : {2U, 3U}) {
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
  for (Node& node : graph.nodes) {
    for (Callback& callback : node.callbacks)
      if (callback.worst > Duration{}) callback.worst = callback.best = 4220us;
  }
  const auto phases = read_phases(std::string(HOTPATH_REFERENCE_DIR) + "/rclcpp_autoware_phases.csv", graph,
                                  reference.executor);
  Platform platform;
  platform.cores = reference.cores;
  platform.set_dispatch_costs(reference.dispatch_cost);
  const Simulated s = simulate_graph(graph, reference.executor, 30s, phases,
                                     {SubscriptionRule::first, Ties::fifo, 2}, platform);
  // The six outputs of a hyperperiod (600 ms) differ, for `events-ro` by a crunch on either side of
  // the median; therefore a whole number of hyperperiods is counted.
  std::vector<double> latencies;
  for (const ChainObservation& o : s.observations) {
    if (o.sink_start >= at(1200ms)) latencies.push_back(to_ms(o.sink_start - o.latest_source_start));
  }
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
}  // namespace hotpath
