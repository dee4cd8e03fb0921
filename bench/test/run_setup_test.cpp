// SPDX-License-Identifier: Apache-2.0
// From options to a run: costs, orders, phases, and what the run records.
#include "setup/run_setup.hpp"

#include <gmock/gmock.h>

#include <set>

#include "bounds/bounds.hpp"
#include "graph_fixture.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "setup/deployed_system.hpp"
#include "setup/setup_facts.hpp"

namespace hotpath::run_setup_test {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::FieldsAre;
using testing::HasSubstr;

class SetupOfAutoware : public testing::Test {
 protected:
  const Graph graph = load_graph(find_graph("autoware"));
  const GraphTasks tasks = make_tasks(graph);
};

TEST(RunSetup, PlatformCostsAreInMicroseconds) {
  setup::PlatformOptions options;
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) options.costs_us[i] = 2.5 + static_cast<double>(i);
  GraphPlatform platform;
  options.apply_to(platform);
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    if (kPlatformCosts[i].both_kinds) continue;  // the options of each kind, which follow, win
    EXPECT_EQ(platform.*kPlatformCosts[i].value, 2500ns + i * 1us) << kPlatformCosts[i].key;
  }
}

/// The order of the tasks A, B and C that a file with these lines gives.
std::vector<TaskId> order_from(const std::string& lines) {
  TaskSet set;
  for (const char* name : {"A", "B", "C"}) set.tasks.emplace_back().name = name;
  const File file("order.txt", lines);
  setup::CommonOptions options;
  options.entity_order.file = file.path();
  return setup::scheduling_of(options, Graph{}, set, 2).entity_order;
}

TEST(RunSetup, TasksThatAnOrderDoesNotNameFollow) {
  EXPECT_THAT(order_from("C\n"), ElementsAre(2, 0, 1));
  EXPECT_THAT(order_from("B\n\nA\n"), ElementsAre(1, 0, 2));
  EXPECT_THAT([] { order_from("A\nB\nA\n"); },
              testing::ThrowsMessage<InputError>(HasSubstr(":3: A occurs twice")));
}

TEST_F(SetupOfAutoware, EachRepetitionDrawsItsOwnPhases) {
  setup::CommonOptions options;
  options.phases = Phases::random;
  const setup::ExecutorSpec executor = setup::parse_executor("default", {});
  const auto phases = [&](std::uint64_t seed, std::uint32_t repetition) {
    options.seed = seed;
    return setup::phases_of_repetition(options, graph, tasks, executor, repetition);
  };
  EXPECT_EQ(phases(7, 1), phases(7, 1));
  EXPECT_NE(phases(7, 0), phases(7, 1));
  EXPECT_NE(phases(7, 0), phases(8, 0));
}

TEST(RunSetup, SubjectsOfARepetitionMayHaveAnyOrder) {
  std::set<std::vector<std::size_t>> orders;
  const auto all = setup::interleaved(200, 3, 1);
  ASSERT_EQ(all.size(), 600U);
  for (std::size_t i = 0; i < all.size(); i += 3) {
    for (std::size_t s = 0; s < 3; ++s) EXPECT_EQ(all[i + s].first, i / 3);
    orders.insert({all[i].second, all[i + 1].second, all[i + 2].second});
  }
  EXPECT_EQ(orders.size(), 6U);
}

TEST_F(SetupOfAutoware, TheTraceOfTheWarmUpTakesMemoryToo) {
  setup::CommonOptions options;
  options.duration_s = options.warm_up_s = 1;
  EXPECT_NO_THROW(setup::check_trace_memory(options, tasks, 1, 0, "less"));
  options.warm_up_s = 1e12;
  EXPECT_THROW(setup::check_trace_memory(options, tasks, 1, 0, "less"), program::UsageError);
}

TEST_F(SetupOfAutoware, TheRecordHasTheLimitsOfTheFirstChain) {
  const auto record = setup::record_of({}, graph, tasks.set, {setup::parse_executor("default", {})});
  EXPECT_THAT(record.limits, ElementsAre(FieldsAre("computation of the longest branch", 21ms),
                                         FieldsAre(testing::_, 25200us)));
}

TEST_F(SetupOfAutoware, TheThreadsOfADeploymentAreNumberedExecutorByExecutor) {
  Deployment plan;
  plan.name = "three";
  for (const char* executor : {"multi:3", "default", "multi:2"}) {
    DeployedExecutor& e = plan.executors.emplace_back();
    e.name = e.executor = executor;
  }
  plan.executor_of.assign(tasks.set.size(), 1);
  const auto record = setup::record_of({}, graph, tasks.set, {setup::deploy(plan, {})});
  const auto& executors = record.deployments.at("three").executors;
  ASSERT_EQ(executors.size(), 3U);
  EXPECT_EQ(executors[0].first_worker, 0U);
  EXPECT_EQ(executors[1].first_worker, 3U);
  EXPECT_EQ(executors[2].first_worker, 4U);
  EXPECT_EQ(executors[2].workers, 2U);
}

TEST(RunSetup, OptionsWithoutEffectAreReported) {
  setup::CommonOptions options;
  const std::vector<setup::ExecutorSpec> plain = {setup::parse_executor("events-ro", {})};
  EXPECT_THAT(setup::idle_options(options, plain), testing::IsEmpty());
  options.entity_order.reverse = true;
  EXPECT_THAT(setup::idle_options(options, plain), ElementsAre(HasSubstr("--entity-order")));
  EXPECT_THAT(setup::idle_options(options,
                                  {setup::parse_executor("rm-ro", {}), setup::parse_executor("default", {})}),
              testing::IsEmpty());
}

TEST(RunSetup, TheRecordHasTheTightestBoundOfEachTimer) {
  const Graph graph = load_graph(find_graph("timers_only_60"));
  const GraphTasks tasks = make_tasks(graph);
  const CallbackGraph callbacks = bounds::callback_graph(graph, tasks, false);
  const setup::ExecutorSpec executor = setup::parse_executor("rm-ro", {});
  const std::vector<GraphBounds> sets = setup::bounds_of(graph, callbacks, executor);
  const auto stored = setup::timer_bounds(graph, tasks, {executor});
  ASSERT_EQ(stored.size(), tasks.set.size());
  bool differ = false;
  for (TaskId id = 0; id < stored.size(); ++id) {
    EXPECT_EQ(stored[id].task, tasks.set[id].name);
    for (const GraphBounds& set : sets) {
      if (set.tasks.empty() || !set.tasks[id]) continue;
      EXPECT_LE(stored[id].response, Duration(*set.tasks[id])) << set.method;
      differ = differ || stored[id].response < Duration(*set.tasks[id]);
    }
  }
  EXPECT_TRUE(differ) << "the methods have different bounds";
}

}  // namespace hotpath::run_setup_test
