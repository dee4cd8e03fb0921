// SPDX-License-Identifier: Apache-2.0
// What theory guarantees for graphs whose worst cases can be worked out by hand, and callbacks that no method
// covers.
#include "setup/deployed_system.hpp"

#include <gmock/gmock.h>

#include "bounds/bounds.hpp"
#include "graph_fixture.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/reference_system/graph_workload.hpp"

namespace hotpath::guarantees_test {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Of S -> N -> C, where N's only callback publishes like this.
CallbackGraph callback_graph_with(const std::string& publishes) {
  const Graph graph = load(
      "name: g\nnodes:\n- {name: S, type: sensor, period_ms: 10, output: s}\n"
      "- {name: N, type: callbacks, callbacks: [{subscription: s, publishes: [" +
      publishes + "]}]}\n- {name: C, type: command, input: a}\n");
  return bounds::callback_graph(graph, make_tasks(graph), false);
}

TEST(CallbackGraph, KnowsHowRarelyATaskPublishes) {
  EXPECT_EQ(callback_graph_with("a, {topic: b, every: 3}").every.at(1), 3U);
  EXPECT_EQ(callback_graph_with("{topic: b, every: 3}, a").every.at(1), 3U);
  EXPECT_EQ(callback_graph_with("a").every.at(1), 1U);
}

TEST(CallbackGraph, CallbacksThatNoMethodCoversAreRejected) {
  for (const auto& [publishes, reason] :
       {std::pair("{topic: a, at_percent: 50}", "N/s, which publishes before the end of its jobs"),
        std::pair("a, {topic: b, when: all_new, of: [s]}",
                  "publishes some topics with every job and others")})
    EXPECT_THAT([&] { callback_graph_with(publishes); },
                testing::ThrowsMessage<AnalysisError>(HasSubstr(reason)));
}

Duration of_autoware(Latency latency, const char* executor,
                     SubscriptionRule rule = SubscriptionRule::inherit) {
  const Graph graph = load_graph(find_graph("autoware"));
  const setup::ExecutorSpec spec = setup::parse_executor(executor, {.rule = rule});
  return Duration(setup::guarantees(graph, make_tasks(graph), spec)->of(latency, "hot_path").value().ns);
}

TEST(Guarantees, OnlyTheFourJobsBehindTheLaterDriverCountWhereNothingMayComeBetween) {
  for (const auto& [executor, rule] :
       {std::pair("fp-ro", SubscriptionRule::inherit), std::pair("fp-ro", SubscriptionRule::first),
        std::pair("rm-ro", SubscriptionRule::first)}) {
    EXPECT_EQ(of_autoware(Latency::hot_path, executor, rule), 16'800us) << executor;
  }
}

TEST(Guarantees, FasterTimersComeBetweenUnderRateMonotonicOrder) {
  // Six more jobs: of the timers with 25 and 60 ms, and of what they and the other driver activate.
  EXPECT_EQ(of_autoware(Latency::hot_path, "rm-ro"), 42ms);
}

TEST(Guarantees, AgeOfDataThatWaitedCountsOneWorstCase) {
  EXPECT_LE(of_autoware(Latency::age, "rm-ro"), 200'500us);  // 150.4 ms are reached
  EXPECT_LE(of_autoware(Latency::age, "fp-ro"), 189'300us);
  EXPECT_LE(of_autoware(Latency::age, "edf-ro"), 201'800us);
  EXPECT_LT(of_autoware(Latency::age, "default"), 566ms);
}

TEST(Guarantees, InputsThatTakeTurnsWaitForTheirPhasesOnly) {
  // Both sensors every 100 ms, Q 3 ms behind P: each job of Q completes the join.
  const Graph graph = load(
      "name: g\nnodes:\n- {name: P, type: sensor, period_ms: 100}\n"
      "- {name: Q, type: sensor, period_ms: 100}\n"
      "- {name: F, type: fusion, inputs: [P, Q], execution_time_ms: 2}\n"
      "chains:\n- {name: c, nodes: [P, Q, F], sources: [P, Q], sink: F}\n");
  GraphTasks tasks = make_tasks(graph);
  const auto age = [&](Duration phase_of_q) {
    tasks.set.tasks[1].phase = phase_of_q;
    const CallbackGraph callbacks = bounds::callback_graph(graph, tasks, true);
    const ExecutorEntry& executor = *find_executor("rm-ro");
    const auto all = graph_bounds({callbacks, executor, {}, make_platform(graph, executor)});
    std::optional<std::int64_t> least;
    for (const GraphBounds& bounds : all) {
      if (bounds.chains.empty() || !bounds.chains[0]) continue;
      least = std::min(least.value_or(bounds.chains[0]->latency), bounds.chains[0]->latency);
    }
    return Duration(least.value());
  };
  EXPECT_EQ(age(3ms), 5ms);
  EXPECT_EQ(age(60ms), 62ms);
  EXPECT_EQ(age(0ms), 2ms);
  EXPECT_EQ(age(99ms), 102ms) << "Q may come behind the next sample of P";
}

TEST(Guarantees, OnSeveralThreadsAJobMayLastAsLongAsItsPeriod) {
  const Graph graph = load(
      "name: g\nplatform: {cores: 2}\nnodes:\n"
      "- {name: S, type: sensor, period_ms: 10, execution_time_ms: 10}\n");
  const auto all = setup::guarantees(graph, make_tasks(graph), setup::parse_executor("multi:2", {}));
  EXPECT_EQ(Duration(all.value().of(Latency::response, "S").value().ns), 10ms);
}

TEST(Guarantees, DataWaitsLongerWhereALateWaitSetSkipsTimestamps) {
  const Graph graph = load(
      "name: g\nnodes:\n- {name: P, type: sensor, period_ms: 20}\n- {name: Q, type: sensor, period_ms: 100}\n"
      "- {name: L, type: sensor, period_ms: 100, execution_time_ms: 50}\n"
      "- {name: F, type: fusion, inputs: [P, Q], execution_time_ms: 2}\n"
      "chains:\n- {name: c, nodes: [P, F], sources: [P], sink: F}\n");
  const auto all = setup::guarantees(graph, make_tasks(graph), setup::parse_executor("default", {}));
  // P starts up to 52 ms late, and F up to 54 ms behind the timestamp of P or Q. A sample of P is the newest
  // until that of P's next timestamp, which may follow the late start, arrives; then Q completes the join.
  EXPECT_EQ(Duration(all.value().of(Latency::age, "c").value().ns), (20ms + 52ms) + 54ms + 54ms);
}

/// A client every second with 1 ms of work, its service with 2 ms and the last priority, and between them a
/// timer that needs 30 ms every 20 ms.
Graph overloaded_service(Duration wait) {
  Graph graph = load(
      "name: g\nnodes:\n"
      "- {name: Client, type: sensor, period_ms: 1000, execution_time_ms: 1, priority: 1}\n"
      "- {name: Hog, type: sensor, period_ms: 20, execution_time_ms: 30, priority: 2}\n"
      "- {name: Service, type: callbacks, callbacks: "
      "[{subscription: Client, service: true, execution_time_ms: 2, priority: 3}]}\n"
      "chains:\n- {name: c, nodes: [Client, Service], sources: [Client], sink: Service}\n");
  graph.service_wait = wait;
  return graph;
}

TEST(Guarantees, AServiceWaitBoundsTheServiceInOverloadAndItsCostToOthers) {
  const auto of = [](Duration wait) {
    const Graph graph = overloaded_service(wait);
    const setup::ExecutorSpec spec = setup::parse_executor("fp-ro", {.service_wait = wait});
    return setup::guarantees(graph, make_tasks(graph), spec).value();
  };
  const bounds::Guarantees with = of(100ms), without = of(0ms);
  // Behind the 30 ms of the timer; with the wait, also behind one service.
  EXPECT_EQ(Duration(without.of(Latency::response, "Client").value().ns), 31ms);
  EXPECT_EQ(Duration(with.of(Latency::response, "Client").value().ns), 33ms);
  EXPECT_FALSE(with.of(Latency::response, "Hog"));  // more than all time
  EXPECT_FALSE(without.of(Latency::response, "Service/Client"));
  EXPECT_EQ(Duration(with.of(Latency::response, "Service/Client").value().ns), 100ms + 30ms + 2ms);
  EXPECT_FALSE(without.of(Latency::age, "c"));
  EXPECT_EQ(Duration(with.of(Latency::age, "c").value().ns), 33ms + 132ms);
}

TEST(Guarantees, WithAServiceWaitDeploymentsHaveNone) {
  const Graph graph = overloaded_service(100ms);
  const GraphTasks tasks = make_tasks(graph);
  Deployment plan;
  plan.name = "plan";
  plan.executors = {
      {.name = "a", .executor = "fp-ro", .policy = parse_thread_policy("fifo:5"), .processors = {0}}};
  plan.executor_of.assign(tasks.set.size(), 0);
  const CallbackGraph callbacks = bounds::callback_graph(graph, tasks, false);
  const auto all = setup::bounds_of(graph, callbacks,
                                    setup::deploy(std::move(plan), {.service_wait = graph.service_wait}));
  EXPECT_THAT(all.at(0).refusal.value(), HasSubstr("service_wait_ms"));
}

TEST(Guarantees, ADeploymentOfPinnedThreadsHasThoseOfItsProcessors) {
  Graph graph = load_graph(find_graph("autoware"));
  graph.platform.cores = 2;
  const GraphTasks tasks = make_tasks(graph);
  const auto picas =
      setup::guarantees(graph, tasks, setup::deploy(find_deployment("picas", graph, tasks), {}));
  // From the rear driver on: its transformer on the other processor, then five jobs before the estimator.
  EXPECT_EQ(Duration(picas.value().of(Latency::hot_path, "hot_path").value().ns), 25'200us);
  EXPECT_FALSE(setup::guarantees(graph, tasks, setup::deploy(find_deployment("isolated", graph, tasks), {})));
}

TEST(Guarantees, ADeploymentKeepsItsProcessorsAndPolicies) {
  Graph graph = load_graph(find_graph("autoware"));
  graph.platform.cores = 2;
  const GraphTasks tasks = make_tasks(graph);
  Deployment plan;
  plan.name = "plan";
  plan.file = "plan.yaml";
  plan.executors = {
      {.name = "a", .executor = "default", .policy = parse_thread_policy("rr:5"), .processors = {1}}};
  plan.executor_of.assign(tasks.set.size(), 0);
  const auto thread = [&] { return setup::threads_of(graph, setup::deploy(plan, {})).at(0); };
  EXPECT_EQ(thread().other_policy, "rr:5");
  EXPECT_EQ(thread().processors, std::vector<unsigned>{1});
  plan.executors[0].policy = parse_thread_policy("fifo:5");
  plan.executors[0].processors = {};
  EXPECT_EQ(thread().other_policy, "");
  EXPECT_EQ(thread().priority, 5);
  EXPECT_EQ(thread().processors, (std::vector<unsigned>{0, 1}));
  plan.executors[0].processors = {2};
  EXPECT_THROW(thread(), InputError);
}

}  // namespace hotpath::guarantees_test
