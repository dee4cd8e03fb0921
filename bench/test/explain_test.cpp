// SPDX-License-Identifier: Apache-2.0
// The causes of a latency: they sum to it for every output of every graph under every executor, and
// known schedules have known causes.
#include <gmock/gmock.h>

#include <algorithm>

#include "explain/explain_report.hpp"
#include "explain/explainer.hpp"
#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/find_chains.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "hotpath/reference_system/reference_node.hpp"
#include "random_graphs.hpp"
#include "results/measures.hpp"
#include "setup/run_setup.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::explain {
namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// A simulated run.
class Simulated {
 public:
  Simulated(Graph graph, const setup::ExecutorSpec& spec, Phases phases, Duration length = 1s)
      : graph_(std::move(graph)), spec_(spec), tasks_(make_tasks(graph_)) {
    setup::set_phases(tasks_.set, make_phases(graph_, tasks_, phases));
    times_ = simulated::execution_times_of(graph_, tasks_, 1);
    const std::vector<results::MeasuredChain> chains = setup::measured_chains(graph_, tasks_);
    simulated::Plan plan{spec_, graph_, tasks_, chains, *times_};
    plan.duration = length;
    trace_ = simulated::simulate_repetition(plan).trace;
  }

  const GraphTasks& tasks() const { return tasks_; }
  const Graph& graph() const { return graph_; }

  std::vector<Explanation> chain(std::uint32_t chain) const {
    std::vector<Output> outputs;
    for (const ChainRecord& r : trace_.chains) {
      if (r.chain == chain && r.hot_path_latency >= Duration{})
        outputs.push_back({0, r.sequence, r.hot_path_latency, r.sink});
    }
    return explained({chain, kNoTask}, outputs);
  }
  std::vector<Explanation> task(TaskId task) const {
    std::vector<Output> outputs;
    for (const JobRecord& r : trace_.jobs) {
      if (r.job.task == task && results::counts(r, Time{}))
        outputs.push_back({0, r.job.sequence, results::response_time(r)});
    }
    return explained({std::nullopt, task}, outputs);
  }

 private:
  std::vector<Explanation> explained(Target target, const std::vector<Output>& outputs) const {
    const System system(spec_, graph_, tasks_, results::RunKind::simulated, graph_.platform.cores);
    std::vector<Explanation> all;
    Explainer explainer(system, target, outputs, "test", [&](const Explanation& e) { all.push_back(e); });
    explainer.begin(0, times_.get());
    for (const JobRecord& r : trace_.jobs) explainer.add(r);
    explainer.end();
    EXPECT_EQ(all.size(), outputs.size());
    EXPECT_EQ(explainer.missing(), 0U);
    return all;
  }

  Graph graph_;
  setup::ExecutorSpec spec_;
  GraphTasks tasks_;
  std::unique_ptr<ExecutionTimes> times_;
  Trace trace_;
};

Duration time_of(const Explanation& e, Cause cause) { return causes_of(e)[static_cast<std::size_t>(cause)]; }

/// The parts as text: cause, time in ms, job behind which it waited, rule.
std::vector<std::string> texts(const Simulated& run, const Explanation& e) {
  std::vector<std::string> all;
  for (const Part& part : e.parts) {
    std::string text = std::string(to_string(part.cause)) + " " + std::to_string(part.length / 1ms);
    if (part.behind.task != kNoTask) text += " behind " + run.tasks().set[part.behind.task].name;
    if (part.rule != Rule::none) text += std::string(": ") + to_string(part.rule);
    all.push_back(text);
  }
  return all;
}

/// Checks one explanation; `exact`: one thread, so every cause is known.
void check(const Simulated& run, const Explanation& e, bool exact) {
  Duration sum{};
  for (const Part& part : e.parts) {
    ASSERT_GT(part.length, Duration{});
    ASSERT_LT(part.step, e.path.size());
    sum += part.length;
  }
  ASSERT_EQ(sum, e.latency);
  ASSERT_TRUE(e.complete);
  if (!exact) return;
  const auto& set = run.tasks().set;
  ASSERT_EQ(time_of(e, Cause::unexplained), Duration{})
      << set[e.path.back().job.task].name << " " << e.path.back().job.sequence << ": "
      << testing::PrintToString(texts(run, e));
  ASSERT_EQ(time_of(e, Cause::displaced), Duration{});
  ASSERT_EQ(time_of(e, Cause::withheld), Duration{});
}

void check_all(const Simulated& run, bool exact) {
  for (std::uint32_t c = 0; c < run.graph().chains.size(); ++c) {
    for (const Explanation& e : run.chain(c)) {
      ASSERT_NO_FATAL_FAILURE(check(run, e, exact)) << run.graph().chains[c].name;
    }
  }
  for (TaskId id = 0; id < run.tasks().set.size(); ++id) {
    for (const Explanation& e : run.task(id)) {
      ASSERT_NO_FATAL_FAILURE(check(run, e, exact)) << run.tasks().set[id].name;
    }
  }
}

Graph with_costs(Graph graph) {
  graph.platform.release_cost = 30us;
  graph.platform.pass_cost = 5us;
  graph.platform.set_dispatch_costs(20us);
  graph.platform.wait_cost = 41us;
  graph.platform.wait_cost_per_entity = 150ns;
  graph.platform.wake_up = 190us;
  graph.platform.delivery_delay = 100us;
  return graph;
}

std::vector<Graph> all_graphs() {
  std::vector<Graph> graphs;
  for (const GraphListing& listing : list_graphs()) {
    if (listing.error.empty()) graphs.push_back(load_graph(find_graph(listing.name)));
  }
  return graphs;
}

Phases phases_of(const Graph& graph) {
  return graph.has_callbacks() ? Phases::synchronous : Phases::creation;
}

TEST(Explain, CausesSumToTheLatencyUnderEveryExecutor) {
  const std::vector<Graph> graphs = all_graphs();
  ASSERT_GT(graphs.size(), 5U);
  std::size_t runs = 0;
  for (const Graph& plain : graphs) {
    for (const bool costs : {false, true}) {
      for (const unsigned cores : {1U, 2U}) {
        Graph graph = costs ? with_costs(plain) : plain;
        graph.platform.cores = cores;
        for (const ExecutorEntry& entry : executors()) {
          SCOPED_TRACE(plain.name + " " + std::string(entry.name) + (costs ? " with costs" : ""));
          const setup::ExecutorSpec spec =
              setup::parse_executor(std::string(entry.name), SchedulerOptions{.workers = 3});
          try {
            const Simulated run(graph, spec, phases_of(graph), 400ms);
            const bool one_thread = worker_count(entry, spec.scheduler) == 1;
            ASSERT_NO_FATAL_FAILURE(check_all(run, one_thread));
            ++runs;
          } catch (const SimulationError&) {
            // An overload under this executor.
          }
        }
      }
    }
  }
  EXPECT_GT(runs, 300U);
}

TEST(Explain, CausesSumToTheLatencyInRandomGraphs) {
  std::size_t runs = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    test::Random random(seed);
    Graph graph = test::random_graph(random);
    graph.chains = find_chains(graph, make_tasks(graph), 4);
    graph.platform.cores = 1 + seed % 2;
    for (const ExecutorEntry& entry : executors()) {
      SCOPED_TRACE(std::to_string(seed) + " " + std::string(entry.name));
      const setup::ExecutorSpec spec =
          setup::parse_executor(std::string(entry.name), SchedulerOptions{.workers = 3});
      try {
        const Simulated run(graph, spec, Phases::random, 300ms);
        ASSERT_NO_FATAL_FAILURE(check_all(run, worker_count(entry, spec.scheduler) == 1));
        ++runs;
      } catch (const SimulationError&) {
        // An overload under this executor.
      }
    }
  }
  EXPECT_GT(runs, 300U);
}

TEST(Explain, CausesSumToTheLatencyInEveryDeployment) {
  for (const char* name : {"autoware", "many_to_many", "callbacks"}) {
    for (const bool costs : {false, true}) {
      Graph graph = load_graph(find_graph(name));
      if (costs) graph = with_costs(graph);
      graph.platform.cores = 2;
      for (const DeploymentPreset& preset : deployment_presets()) {
        SCOPED_TRACE(std::string(name) + " " + std::string(preset.name));
        const setup::ExecutorSpec spec =
            setup::deploy(std::string(preset.name), graph, make_tasks(graph), {});
        const Simulated run(graph, spec, phases_of(graph), 400ms);
        ASSERT_NO_FATAL_FAILURE(check_all(run, false));
      }
    }
  }
}

/// A timer with a period of 100 ms, if not given otherwise.
ReferenceNode timer(const std::string& name, Duration work, Duration period = 100ms, Duration phase = 0ms) {
  ReferenceNode node;
  node.name = name;
  node.type = NodeType::sensor;
  node.period = node.deadline = period;
  node.phase = phase;
  node.outputs = {name};
  node.execution_time = node.best_case_execution_time = work;
  return node;
}
Node follower(const std::string& name, const std::vector<std::string>& inputs, Duration work,
              std::uint32_t depth = 1) {
  ReferenceNode node;
  node.name = name;
  node.type = inputs.size() > 1 ? NodeType::fusion : NodeType::transform;
  for (const std::string& input : inputs) node.inputs.push_back({input, depth, std::nullopt});
  node.outputs = {name};
  node.execution_time = node.best_case_execution_time = work;
  return node;
}
Graph graph_of(std::vector<Node> nodes, std::vector<std::string> sources, const std::string& sink) {
  Graph graph;
  graph.name = "test";
  Chain chain{"chain", {}, std::move(sources), sink};
  for (const Node& node : nodes) chain.nodes.push_back(node.name);
  graph.nodes = std::move(nodes);
  graph.chains = {chain};
  return graph;
}

Explanation first(const Graph& graph, const std::string& executor, std::vector<std::string>* parts) {
  const Simulated run(graph, setup::parse_executor(executor, {}), Phases::given, 95ms);
  const std::vector<Explanation> all = run.chain(0);
  EXPECT_EQ(all.size(), 1U);
  *parts = texts(run, all.front());
  return all.front();
}

TEST(Explain, TimersGoBeforeSubscriptions) {
  const Graph graph = graph_of(
      {timer("a", 1ms), timer("b", 2ms, 100ms, 1ms), follower("f", {"a"}, 3ms), follower("sink", {"f"}, 1ms)},
      {"a"}, "sink");
  std::vector<std::string> parts;
  first(graph, "default", &parts);
  EXPECT_THAT(parts,
              ElementsAre("running 1", "executor 2 behind b: timers before subscriptions", "running 3"));
  first(graph, "static", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "running 3", "snapshot 2 behind b: in an earlier snapshot"));
}

TEST(Explain, ASnapshotIsTakenTooEarly) {
  const Graph graph = graph_of({timer("a", 1ms), timer("b", 2ms), timer("c", 4ms), follower("f", {"a"}, 3ms),
                                follower("sink", {"f"}, 1ms)},
                               {"a"}, "sink");
  std::vector<std::string> parts;
  first(graph, "default", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "snapshot 2 behind b: in an earlier snapshot",
                                 "snapshot 4 behind c: in an earlier snapshot", "running 3"));
}

TEST(Explain, AnEventWaitsForEarlierOnesAndARateForHigherOnes) {
  const Graph graph = graph_of(
      {timer("a", 1ms), timer("b", 2ms, 50ms), follower("f", {"a"}, 3ms), follower("sink", {"f"}, 1ms)},
      {"a"}, "sink");
  std::vector<std::string> parts;
  first(graph, "events-ro", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "executor 2 behind b: earlier event (FIFO)", "running 3"));
  Graph late = graph;
  late.nodes[1].callbacks[0].phase = 1ms;
  first(late, "rm-ro", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "executor 2 behind b: higher priority", "running 3"));
  first(late, "edf-ro", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "executor 2 behind b: earlier deadline", "running 3"));
}

/// A service that runs ahead of its priority after 10 ms: the rules by which it goes before timer `b`.
std::vector<std::string> behind_a_service(Duration period_of_caller, Duration phase_of_b, bool costs) {
  Node service = follower("s", {"a"}, 3ms);
  service.callbacks[0].service = true;
  service.type = NodeType::callbacks;
  Graph graph = graph_of({timer("a", 1ms, period_of_caller), timer("c", 9ms, 25ms, 1ms), service,
                          timer("b", 4ms, 100ms, phase_of_b)},
                         {"a"}, "s");
  if (costs) {
    graph.platform.delivery_delay = 2ms;
    graph.platform.set_dispatch_costs(1ms);
  } else {
    graph.nodes[1].callbacks[0].worst = graph.nodes[1].callbacks[0].best = 15ms;
  }
  SchedulerOptions scheduling;
  scheduling.guaranteed_wait = 10ms;
  const Simulated run(graph, setup::parse_executor("rm-ro", scheduling), Phases::given, 45ms);
  std::vector<std::string> behind;
  for (const Explanation& e : run.task(3)) {
    for (const std::string& text : texts(run, e)) {
      if (text.find("behind s") != std::string::npos) behind.push_back(text);
    }
  }
  return behind;
}

TEST(Explain, AServiceGoesFirstByItsWaitOnlyIfItHasALowerPlace) {
  EXPECT_THAT(behind_a_service(200ms, 2ms, false),
              ElementsAre("executor 3 behind s/a: waited for the service wait"));
  EXPECT_THAT(behind_a_service(100ms, 2ms, false),
              ElementsAre("executor 3 behind s/a: same priority, ahead by the tie rule"));
  EXPECT_THAT(behind_a_service(50ms, 2ms, false), ElementsAre("executor 3 behind s/a: higher priority"));
}

TEST(Explain, AServiceWaitsFromTheArrivalOfItsSample) {
  // The service starts 11 ms after the publication and 9 ms after the arrival: it was chosen before b's
  // release.
  EXPECT_THAT(behind_a_service(200ms, 12500us, true),
              ElementsAre("executor 3 behind s/a: chosen before this job's release"));
}

TEST(Explain, AFusionWaitsForItsOtherInput) {
  const Graph graph = graph_of(
      {timer("late", 1ms, 100ms, 10ms), timer("early", 9ms, 100ms, 0ms), follower("slow", {"early"}, 20ms),
       follower("fusion", {"late", "slow"}, 2ms), follower("sink", {"fusion"}, 1ms)},
      {"late", "early"}, "sink");
  Graph two_cores = graph;
  two_cores.platform.cores = 2;
  std::vector<std::string> parts;
  first(two_cores, "multi:2", &parts);
  // `slow` runs from 9 to 29 ms, `late` from 10 to 11 ms.
  EXPECT_THAT(parts, ElementsAre("running 1", "join 18", "running 2"));
}

TEST(Explain, AMessageWithoutTheSampleIsNotOnThePath) {
  ReferenceNode cyclic = timer("y", 0ms, 10ms, 5ms);
  cyclic.type = NodeType::cyclic;
  cyclic.inputs.push_back({"s", 1, std::nullopt});
  const Graph graph = graph_of(
      {timer("s", 1ms), cyclic, follower("t", {"s"}, 20ms), follower("f", {"t", "y"}, 1ms)}, {"s"}, "f");
  // At 21 ms, the first message of `y` has the sample of `s`, and the second, with which `f` begins, not.
  const Simulated run(graph, setup::parse_executor("events-ro", {}), Phases::given, 25ms);
  const std::vector<Explanation> all = run.chain(0);
  ASSERT_FALSE(all.empty());
  std::vector<std::string> path;
  for (const JobRecord& job : all.front().path) path.push_back(run.tasks().set[job.job.task].name);
  EXPECT_THAT(path, ElementsAre("s", "t/s", "f/t", "f/y"));
}

TEST(Explain, AnOlderSampleIsServedFirst) {
  const Graph graph = graph_of(
      {timer("a", 1ms, 10ms), follower("f", {"a"}, 8ms, 10), timer("b", 25ms, 100ms, 5ms)}, {"a"}, "f");
  const Simulated run(graph, setup::parse_executor("events-ro", {}), Phases::given, 95ms);
  std::vector<std::string> all;
  for (const Explanation& e : run.task(1)) {
    for (const std::string& text : texts(run, e)) all.push_back(text);
  }
  EXPECT_THAT(all, Contains("older_sample 8 behind f/a"));
}

TEST(Explain, AnotherThreadDisplacesTheJob) {
  const Graph graph = graph_of({timer("a", 1ms), follower("f", {"a"}, 10ms), timer("b", 3ms, 100ms, 4ms),
                                follower("sink", {"f"}, 1ms)},
                               {"a"}, "sink");
  std::vector<std::string> parts;
  const Explanation e = first(graph, "rm-re", &parts);
  EXPECT_THAT(parts, ElementsAre("running 1", "running 3", "displaced 3 behind b", "running 7"));
  EXPECT_EQ(e.latency, 14ms);
}

TEST(Explain, CostsOfThePlatformAreNamed) {
  Graph graph =
      graph_of({timer("a", 1ms), follower("f", {"a"}, 3ms), follower("sink", {"f"}, 1ms)}, {"a"}, "sink");
  graph.platform.delivery_delay = 2ms;
  graph.platform.set_dispatch_costs(1ms);
  std::vector<std::string> parts;
  first(graph, "rm-ro", &parts);
  EXPECT_THAT(parts,
              ElementsAre("running 1", "delivery 2", "overhead 1", "running 3", "delivery 2", "overhead 1"));
}

TEST(Explain, TheReleasesOfTheTimerThreadDisplaceAJob) {
  Graph graph = graph_of(
      {timer("a", 1ms), follower("f", {"a"}, 3ms), timer("b", 1ms, 100ms, 3ms), follower("sink", {"f"}, 1ms)},
      {"a"}, "sink");
  graph.platform.release_cost = 1ms;
  std::vector<std::string> parts;
  first(graph, "rm-ro", &parts);
  EXPECT_THAT(parts, Contains("displaced 1"));
}

/// A job that ran on thread `worker`.
JobRecord ran(TaskId task, Duration start, Duration finish, std::uint16_t worker = 0) {
  JobRecord r;
  r.job.task = task;
  r.start = Time{start};
  r.finish = Time{finish};
  r.worker = worker;
  return r;
}
JobRecord sampled(JobRecord r, Duration at) {
  r.job.parent = {0, 0};
  r.job.timestamp = r.job.release = Time{at};
  return r;
}
JobRecord with_cpu_time(JobRecord r, Duration time) {
  r.cpu_time = time;
  return r;
}

struct Asked {
  Target target;
  Output output;
};

/// The parts of the only output, of these jobs.
std::vector<Part> parts_of(const Graph& graph, const char* executor, results::RunKind kind, unsigned cores,
                           const Asked& asked, const std::vector<JobRecord>& jobs) {
  const GraphTasks tasks = make_tasks(graph);
  const setup::ExecutorSpec spec = setup::parse_executor(executor, {});
  const System system(spec, graph, tasks, kind, cores);
  std::vector<Part> parts;
  Explainer explainer(system, asked.target, {asked.output}, "test",
                      [&](const Explanation& e) { parts = e.parts; });
  explainer.begin(0, nullptr);
  for (const JobRecord& job : jobs) explainer.add(job);
  explainer.end();
  return parts;
}

auto part(Cause cause, Duration length) {
  return testing::AllOf(testing::Field(&Part::cause, cause), testing::Field(&Part::length, length));
}

TEST(Explain, TimeWithoutAnyCauseIsUnexplained) {
  // The job that the sink waited for is taken out of the trace.
  const Graph graph =
      graph_of({timer("a", 1ms), timer("b", 2ms, 100ms, 1ms), follower("sink", {"a"}, 1ms)}, {"a"}, "sink");
  EXPECT_THAT(parts_of(graph, "default", results::RunKind::simulated, 1, {{0, kNoTask}, {0, 0, 3ms}},
                       {ran(0, 0ms, 1ms), sampled(ran(2, 3ms, 4ms), 1ms)}),
              ElementsAre(part(Cause::running, 1ms), part(Cause::unexplained, 2ms)));
}

TEST(Explain, TheProcessorIsWithheld) {
  const Graph follow = graph_of({timer("a", 10ms), follower("sink", {"a"}, 1ms)}, {"a"}, "sink");
  const auto of_a = [&](Duration cpu_time) {
    return parts_of(follow, "default", results::RunKind::live, 1, {{std::nullopt, 0}, {0, 0, 10ms}},
                    {with_cpu_time(ran(0, 0ms, 10ms), cpu_time)});
  };
  EXPECT_THAT(of_a(7ms), ElementsAre(part(Cause::running, 7ms), part(Cause::withheld, 3ms)));
  EXPECT_THAT(of_a(Duration(-1)), ElementsAre(part(Cause::running, 10ms))) << "it has no CPU time";
  // Before a publication to another thread, which comes before the end of `a`.
  EXPECT_THAT(parts_of(follow, "multi:2", results::RunKind::live, 2, {{0, kNoTask}, {0, 0, 9ms, 1}},
                       {with_cpu_time(ran(0, 0ms, 10ms), 4ms), sampled(ran(1, 9ms, 11ms, 1), 9ms)}),
              ElementsAre(part(Cause::running, 4ms), part(Cause::withheld, 5ms)));
  // From a job that went first.
  const Graph two = graph_of({timer("a", 10ms), timer("b", 10ms)}, {"a"}, "b");
  const std::vector<Part> parts =
      parts_of(two, "default", results::RunKind::live, 1, {{std::nullopt, 1}, {0, 0, 11ms}},
               {with_cpu_time(ran(0, 0ms, 10ms), 4ms), with_cpu_time(ran(1, 10ms, 11ms), 1ms)});
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].length, 4ms);
  EXPECT_THAT(parts[1], part(Cause::withheld, 6ms));
  EXPECT_EQ(parts[1].behind, (JobRef{0, 0}));
  EXPECT_EQ(parts[2].cause, Cause::running);
}

}  // namespace
}  // namespace hotpath::explain
