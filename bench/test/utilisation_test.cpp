// SPDX-License-Identifier: Apache-2.0
// The sentences about work that threads, groups and cores cannot do, on graphs whose load is plain.
#include "setup/utilisation.hpp"

#include <gmock/gmock.h>

#include "graph_fixture.hpp"
#include "program/text.hpp"

namespace hotpath::utilisation_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A timer and a subscription of depth 1 with this work, of two nodes, on two cores.
Graph graph_with(double timer_ms, double reader_ms) {
  Graph graph = load(program::text(
      "name: g\nnodes:\n- {name: T, type: sensor, period_ms: 10, execution_time_ms: %g, output: t}\n"
      "- {name: R, type: callbacks, callbacks: [{subscription: t, depth: 1, execution_time_ms: %g}]}\n",
      timer_ms, reader_ms));
  graph.platform.cores = 2;
  return graph;
}

setup::Utilisation of(const Graph& graph, const std::string& executor,
                      const setup::LiveThreads* live = nullptr) {
  const setup::ExecutorSpec spec = setup::parse_executor(executor, {});
  return setup::utilisation(graph, make_tasks(graph), &spec, live);
}

TEST(Utilisation, OverloadsThreadsBeforeCores) {
  const Graph graph = graph_with(6, 6);
  EXPECT_THAT(of(graph, "default").warnings,
              ElementsAre("default is overloaded: it has 120 % of one core of work for 1 thread."));
  EXPECT_THAT(of(graph, "multi:2").warnings, IsEmpty());
  EXPECT_NEAR(of(graph, "multi:2").percent, 60, 1e-9);
  EXPECT_THAT(of(graph_with(9.5, 0), "default").warnings, IsEmpty());
  const Graph full = graph_with(10, 9.9);
  EXPECT_THAT(of(full, "multi:2").overload.value(), HasSubstr("callback group of T has 100 %"));
  EXPECT_THAT(of(full, "rm-re").overload.value(), HasSubstr("its timer thread has 100 %"));
  EXPECT_THAT(setup::utilisation(graph_with(15, 8), make_tasks(graph_with(15, 8)), nullptr).overload.value(),
              HasSubstr("callback group of T has 150 %"));
}

TEST(Utilisation, AReaderThatLeavesOutSamplesFillsAThreadAndOverloadsNone) {
  const Graph graph = graph_with(0, 40);
  EXPECT_EQ(of(graph, "default").overload, std::nullopt);
  EXPECT_NEAR(of(graph, "default").percent, 100, 1e-9);
  EXPECT_THAT(setup::intended_losses(graph, make_tasks(graph)),
              ElementsAre(0, testing::DoubleNear(0.75, 1e-9)));
}

TEST(Utilisation, NamesThreadsThatGainNothing) {
  Graph graph = graph_with(1, 1);
  EXPECT_THAT(of(graph, "multi:4").warnings,
              ElementsAre("multi:4: it has 4 threads for 2 cores, so more than 2 of them gain nothing."));
  EXPECT_THAT(of(graph_with(0, 1), "cbg:2").warnings,
              ElementsAre(HasSubstr("for 1 mutually exclusive group,")));
}

TEST(Utilisation, NamesTheKernelsRuleForRealTimeThreads) {
  const Graph graph = graph_with(9.5, 0);
  machine::Machine machine;
  machine.rt_runtime_us = 950'000;
  machine.rt_period_us = 1'000'000;
  const setup::LiveThreads live{machine, parse_thread_policy("rr:10"), {}};
  const auto on = [&](const char* kernel) {
    machine.kernel = kernel;
    return of(graph, "default", &live).warnings;
  };
  EXPECT_THAT(on("6.11.2 x86_64"), ElementsAre(HasSubstr("Linux 6.11 stops such threads for 50 of 1000 ms")));
  EXPECT_THAT(on("6.12.0 x86_64"), ElementsAre(HasSubstr("the fair server of Linux 6.12")));
  machine.rt_runtime_us = -1;
  EXPECT_THAT(on("5.15.0"), IsEmpty());
  EXPECT_THAT(of(graph, "rm-re").warnings, ElementsAre(HasSubstr("Linux up to 6.11 stops")));
  EXPECT_THAT(of(graph_with(9.4, 0), "rm-re").warnings, IsEmpty());
}

}  // namespace hotpath::utilisation_test
