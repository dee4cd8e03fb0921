// SPDX-License-Identifier: Apache-2.0
// The causes of a latency: they sum to it for every output of every graph under every executor, and
// known schedules have known causes.
#include <gmock/gmock.h>

#include "explained.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "random_graphs.hpp"
#include "reference_nodes.hpp"
#include "results/measures.hpp"

namespace hotpath::explain::explain_test {

using namespace std::chrono_literals;
using testing::Contains;
using testing::ElementsAre;

std::vector<Explanation> of_chain(const Simulated& run, std::uint32_t chain, Latency of = Latency::hot_path) {
  std::vector<Output> outputs;
  for (const ChainRecord& r : run.trace().chains) {
    const auto latency = r.latency(of);
    if (r.chain == chain && latency >= Duration{}) outputs.push_back({0, r.sequence, *latency, r.sink});
  }
  return run.explained(chain, outputs, of);
}
std::vector<Explanation> of_task(const Simulated& run, TaskId task) {
  std::vector<Output> outputs;
  for (const JobRecord& r : run.trace().jobs) {
    if (r.job.task == task && results::counts(r, Time{}))
      outputs.push_back({0, r.job.sequence, r.response_time(), task});
  }
  return run.explained(std::nullopt, outputs);
}

/// The parts as text: cause, time in ms, job behind which it waited, rule.
std::vector<std::string> texts(const Simulated& run, const std::vector<Explanation>& explanations) {
  std::vector<std::string> all;
  for (const Explanation& e : explanations) {
    for (const Part& part : e.parts) {
      std::string text = std::string(to_string(part.cause)) + " " + std::to_string(part.length / 1ms);
      if (part.behind.task != kNoTask) text += " behind " + run.tasks().set[part.behind.task].name;
      if (part.rule != Rule::none) text += std::string(": ") + to_string(part.rule);
      all.push_back(text);
    }
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
    const bool known =
        part.cause != Cause::unexplained && part.cause != Cause::displaced && part.cause != Cause::withheld;
    ASSERT_TRUE(known || !exact) << e.path.back().job.sequence << ": "
                                 << testing::PrintToString(texts(run, {e}));
  }
  ASSERT_EQ(sum, e.latency);
  ASSERT_TRUE(e.complete);
  for (const ThreadsInWait& wait : e.waits)
    ASSERT_TRUE(!exact && wait.from < wait.to && wait.to == e.path[wait.step].start && wait.threads > 1);
}

void check_all(const Simulated& run, bool exact) {
  const auto check_each = [&](const std::vector<Explanation>& all, const std::string& name) {
    for (const Explanation& e : all) ASSERT_NO_FATAL_FAILURE(check(run, e, exact)) << name;
  };
  for (std::uint32_t c = 0; c < run.graph().chains.size(); ++c) {
    for (const Latency latency : {Latency::hot_path, Latency::age})
      ASSERT_NO_FATAL_FAILURE(check_each(of_chain(run, c, latency), run.graph().chains[c].name));
  }
  for (TaskId id = 0; id < run.tasks().set.size(); ++id)
    ASSERT_NO_FATAL_FAILURE(check_each(of_task(run, id), run.tasks().set[id].name));
}

Graph with_costs(Graph graph) {
  graph.platform.release_cost = 30us;
  graph.platform.pass_cost = 5us;
  graph.platform.set_dispatch_costs(20us);
  graph.platform.wait_cost = 41us;
  graph.platform.wait_cost_per_entity = 150ns;
  graph.platform.wake_up_latency = 190us;
  graph.platform.delivery_delay = 100us;
  return graph;
}

Phases phases_of(const Graph& graph) {
  return graph.has_callbacks() ? Phases::synchronous : Phases::creation;
}

/// Checks a run under every executor that the graph does not overload, and counts these.
void check_executors(const Graph& graph, Phases phases, Duration length, std::size_t& runs) {
  for (const ExecutorEntry& entry : executors()) {
    SCOPED_TRACE(graph.name + " " + std::string(entry.name));
    const setup::ExecutorSpec spec =
        setup::parse_executor(std::string(entry.name), SchedulerOptions{.workers = 3});
    try {
      const Simulated run(graph, spec, phases, length);
      ASSERT_NO_FATAL_FAILURE(check_all(run, worker_count(entry, spec.scheduler) == 1));
      ++runs;
    } catch (const SimulationError&) {
      // An overload under this executor.
    }
  }
}

TEST(Explain, CausesSumToTheLatencyInRandomGraphs) {
  std::size_t runs = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    Graph graph = test::random_graph(random);
    graph.chains = find_chains(graph, make_tasks(graph), 4);
    graph.platform.cores = 1 + seed % 2;
    ASSERT_NO_FATAL_FAILURE(check_executors(graph, Phases::random, 300ms, runs));
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
        const setup::ExecutorSpec spec = setup::deploy(preset.make(graph, make_tasks(graph)), {});
        const Simulated run(graph, spec, phases_of(graph), 400ms);
        ASSERT_NO_FATAL_FAILURE(check_all(run, false));
      }
    }
  }
}

/// A timer with a period of 100 ms, if not given otherwise.
ReferenceNode timer(const std::string& name, Duration work, Duration period = 100ms, Duration phase = 0ms) {
  ReferenceNode node = reference_node(name, NodeType::sensor, {}, period, work);
  node.phase = phase;
  return node;
}
Node follower(const std::string& name, const std::vector<std::string>& inputs, Duration work,
              std::uint32_t depth = 1) {
  std::vector<ReferenceInput> all;
  all.reserve(inputs.size());
  for (const std::string& input : inputs) all.push_back({input, depth, std::nullopt});
  return reference_node(name, all.size() > 1 ? NodeType::fusion : NodeType::transform, all, {}, work);
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

/// Timer `a`, then `f`, then `sink`, beside other timers.
Graph a_to_sink(std::vector<Node> others, Duration work_of_f = 3ms) {
  std::vector<Node> nodes = {timer("a", 1ms)};
  nodes.insert(nodes.end(), others.begin(), others.end());
  nodes.insert(nodes.end(), {follower("f", {"a"}, work_of_f), follower("sink", {"f"}, 1ms)});
  return graph_of(std::move(nodes), {"a"}, "sink");
}

/// The parts of the only output.
std::vector<std::string> parts_of_first(const Graph& graph, const std::string& executor) {
  const Simulated run(graph, setup::parse_executor(executor, {}), Phases::given, 95ms);
  const std::vector<Explanation> all = of_chain(run, 0);
  EXPECT_EQ(all.size(), 1U);
  return texts(run, all);
}

TEST(Explain, KnownSchedulesHaveKnownCauses) {
  const Graph early = a_to_sink({timer("b", 2ms, 50ms)}), late = a_to_sink({timer("b", 2ms, 50ms, 1ms)});
  const Graph other = a_to_sink({timer("b", 2ms, 100ms, 1ms)});
  Graph costs = a_to_sink({});
  costs.platform.delivery_delay = 2ms;
  costs.platform.set_dispatch_costs(1ms);
  Graph fusion = graph_of(
      {timer("late", 1ms, 100ms, 10ms), timer("early", 9ms, 100ms, 0ms), follower("slow", {"early"}, 20ms),
       follower("fusion", {"late", "slow"}, 2ms), follower("sink", {"fusion"}, 1ms)},
      {"late", "early"}, "sink");
  fusion.platform.cores = 2;
  struct Case {
    const char* executor;
    Graph graph;
    std::vector<std::string> parts;
  };
  for (const Case& c : std::vector<Case>{
           {"default", other, {"running 1", "executor 2 behind b: timers before subscriptions", "running 3"}},
           {"static", other, {"running 1", "running 3", "snapshot 2 behind b: in an earlier snapshot"}},
           {"default",
            a_to_sink({timer("b", 2ms), timer("c", 4ms)}),
            {"running 1", "snapshot 2 behind b: in an earlier snapshot",
             "snapshot 4 behind c: in an earlier snapshot", "running 3"}},
           {"default",
            a_to_sink({follower("g", {"a"}, 2ms)}),
            {"running 1", "executor 2 behind g/a: earlier in the wait set's snapshot", "running 3"}},
           {"events-ro", early, {"running 1", "executor 2 behind b: earlier event (FIFO)", "running 3"}},
           {"rm-ro", late, {"running 1", "executor 2 behind b: higher priority", "running 3"}},
           {"edf-ro", late, {"running 1", "executor 2 behind b: earlier deadline", "running 3"}},
           // `slow` runs from 9 to 29 ms, `late` from 10 to 11 ms.
           {"multi:2", fusion, {"running 1", "join 18", "running 2"}},
           // Another thread displaces `f`.
           {"rm-re",
            a_to_sink({timer("b", 3ms, 100ms, 4ms)}, 10ms),
            {"running 1", "running 3", "displaced 3 behind b", "running 7"}},
           {"rm-ro",
            costs,
            {"running 1", "delivery 2", "overhead 1", "running 3", "delivery 2", "overhead 1"}}}) {
    EXPECT_EQ(parts_of_first(c.graph, c.executor), c.parts) << c.executor;
  }
}

TEST(Explain, TheReleasesOfTheTimerThreadDisplaceAJob) {
  Graph graph = a_to_sink({timer("b", 1ms, 100ms, 3ms)});
  graph.platform.release_cost = 1ms;
  EXPECT_THAT(parts_of_first(graph, "rm-ro"), Contains("displaced 1"));
}

TEST(Explain, TheTimerThreadAndTheExecutorsWakeUpForATimer) {
  Graph graph = a_to_sink({timer("b", 1ms, 100ms, 50ms)});
  graph.platform.wake_up_latency = 1ms;
  const Simulated run(graph, setup::parse_executor("rm-ro", {}), Phases::given, 95ms);
  EXPECT_THAT(texts(run, of_task(run, 1)), ElementsAre("overhead 2", "running 1"));
}

/// A service that runs ahead of its priority after 10 ms: the rules by which it goes before timer `b`.
std::vector<std::string> behind_a_service(Duration period_of_caller, Duration phase_of_b, bool costs) {
  Node service = follower("s", {"a"}, 3ms);
  service.callbacks[0].entity = EntityKind::service;
  service.type = NodeType::callbacks;
  Graph graph = graph_of({timer("a", 1ms, period_of_caller), timer("c", 9ms, 25ms, 1ms), service,
                          timer("b", 4ms, 100ms, phase_of_b)},
                         {"a"}, "s");
  if (costs) {
    graph.platform.delivery_delay = 2ms;
    graph.platform.set_dispatch_costs(1ms);
  } else {
    graph.nodes[1].callbacks[0].worst = graph.nodes[1].callbacks[0].best = 10ms;  // until the wait ends
  }
  const Simulated run(graph, setup::parse_executor("rm-ro", {.service_wait = 10ms}), Phases::given, 45ms);
  std::vector<std::string> behind = texts(run, of_task(run, 3));
  std::erase_if(behind, [](const std::string& text) { return text.find("behind s") == std::string::npos; });
  return behind;
}

TEST(Explain, AServiceGoesFirstByItsWaitOnlyIfItHasALowerPlace) {
  for (const auto& [period_of_caller, rule] :
       {std::pair(200ms, "waited for the service wait"),
        std::pair(100ms, "same priority, ahead by the tie rule"), std::pair(50ms, "higher priority")}) {
    EXPECT_THAT(behind_a_service(period_of_caller, 2ms, false),
                ElementsAre(std::string("executor 3 behind s/a: ") + rule));
  }
  // It starts 11 ms after the publication and 9 ms after the arrival: it was chosen before b's release.
  EXPECT_THAT(behind_a_service(200ms, 12500us, true),
              ElementsAre("executor 3 behind s/a: chosen before this job's release"));
}

TEST(Explain, AnOlderSampleIsServedFirst) {
  const Graph graph = graph_of(
      {timer("a", 1ms, 10ms), follower("f", {"a"}, 8ms, 10), timer("b", 25ms, 100ms, 5ms)}, {"a"}, "f");
  const Simulated run(graph, setup::parse_executor("events-ro", {}), Phases::given, 95ms);
  EXPECT_THAT(texts(run, of_task(run, 1)), Contains("older_sample 8 behind f/a"));
}

/// A job that ran.
JobRecord ran(TaskId task, Duration start, Duration finish, Duration cpu_time = Duration(-1)) {
  JobRecord r;
  r.job.task = task;
  r.start = Time{start};
  r.finish = Time{finish};
  r.cpu_time = cpu_time;
  return r;
}
/// The same, started by a sample of the first job.
JobRecord sampled(JobRecord r, Duration at, std::uint16_t worker = 0) {
  r.job.parent = {0, 0};
  r.job.timestamp = r.job.release = Time{at};
  r.worker = worker;
  return r;
}

/// The parts of the only output, of these jobs.
std::vector<Part> parts_of(const Graph& graph, const char* executor, results::RunKind kind,
                           std::optional<std::uint32_t> chain, const Output& output,
                           const std::vector<JobRecord>& jobs) {
  const GraphTasks tasks = make_tasks(graph);
  const System system(setup::parse_executor(executor, {}), graph, tasks, kind, 1);
  std::vector<Part> parts;
  Explainer explainer(system, chain, Latency::hot_path, {output}, nullptr,
                      [&](const Explanation& e) { parts = e.parts; });
  for (const JobRecord& job : jobs) explainer.add(job);
  explainer.end();
  return parts;
}

auto part(Cause cause, Duration length, JobRef behind = {}) {
  return testing::AllOf(testing::Field(&Part::cause, cause), testing::Field(&Part::length, length),
                        testing::Field(&Part::behind, behind));
}

TEST(Explain, TimeWithoutAnyCauseIsUnexplained) {
  // The job that the sink waited for is taken out of the trace.
  const Graph graph =
      graph_of({timer("a", 1ms), timer("b", 2ms, 100ms, 1ms), follower("sink", {"a"}, 1ms)}, {"a"}, "sink");
  EXPECT_THAT(parts_of(graph, "default", results::RunKind::simulated, 0, {0, 0, 3ms, 2},
                       {ran(0, 0ms, 1ms), sampled(ran(2, 3ms, 4ms), 1ms)}),
              ElementsAre(part(Cause::running, 1ms), part(Cause::unexplained, 2ms)));
}

TEST(Explain, TheProcessorIsWithheld) {
  const auto live = results::RunKind::live;
  const Graph follow = graph_of({timer("a", 10ms), follower("sink", {"a"}, 1ms)}, {"a"}, "sink");
  const auto of_a = [&](Duration cpu_time) {
    return parts_of(follow, "default", live, std::nullopt, {0, 0, 10ms, 0}, {ran(0, 0ms, 10ms, cpu_time)});
  };
  EXPECT_THAT(of_a(7ms), ElementsAre(part(Cause::running, 7ms), part(Cause::withheld, 3ms)));
  EXPECT_THAT(of_a(Duration(-1)), ElementsAre(part(Cause::running, 10ms))) << "it has no CPU time";
  // Before a publication to another thread, which comes before the end of `a`.
  EXPECT_THAT(parts_of(follow, "multi:2", live, 0, {0, 0, 9ms, 1},
                       {ran(0, 0ms, 10ms, 4ms), sampled(ran(1, 9ms, 11ms), 9ms, 1)}),
              ElementsAre(part(Cause::running, 4ms), part(Cause::withheld, 5ms)));
  // From a job that went first.
  const Graph two = graph_of({timer("a", 10ms), timer("b", 10ms)}, {"a"}, "b");
  EXPECT_THAT(parts_of(two, "default", live, std::nullopt, {0, 0, 11ms, 1},
                       {ran(0, 0ms, 10ms, 4ms), ran(1, 10ms, 11ms, 1ms)}),
              ElementsAre(part(Cause::executor, 4ms, {0, 0}), part(Cause::withheld, 6ms, {0, 0}),
                          part(Cause::running, 1ms)));
}

}  // namespace hotpath::explain::explain_test
