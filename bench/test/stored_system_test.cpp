// SPDX-License-Identifier: Apache-2.0
// The system of a stored run is the one that ran.
#include "setup/stored_system.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "graph_fixture.hpp"
#include "program/errors.hpp"
#include "setup/setup_facts.hpp"

namespace hotpath::stored_system_test {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace std::chrono_literals;

/// The system that a run folder with this run.json has.
setup::StoredSystem stored(const results::RunRecord& record) {
  const Folder folder;
  std::ofstream(folder.path() / "run.json") << nlohmann::json(record);
  return setup::stored_system(results::StoredRun(folder.path(), "RUN"));
}

class StoredSystemTest : public testing::Test {
 protected:
  StoredSystemTest() { options_.graph = "autoware"; }

  results::RunRecord record(const std::vector<setup::ExecutorSpec>& executors) {
    results::RunRecord record = setup::record_of(options_, graph_, tasks_.set, executors);
    record.simulation.emplace(results::SimulationRecord{graph_.platform, "worst"});
    return record;
  }

  setup::CommonOptions options_;
  Graph graph_ = load_graph(find_graph("autoware"));
  GraphTasks tasks_ = make_tasks(graph_);
};

TEST_F(StoredSystemTest, HasTheOrderThatItsFileHadThen) {
  options_.entity_order.file = "/no/longer/there.txt";
  options_.entity_tasks = {tasks_.set[3].name, tasks_.set[1].name};
  const SchedulerOptions scheduling = setup::scheduling_of(options_, graph_, tasks_.set, 2);
  const setup::StoredSystem system = stored(record({setup::parse_executor("default", scheduling)}));
  EXPECT_THAT(system.executor("default").scheduler.entity_order, ElementsAre(3, 1));
}

TEST_F(StoredSystemTest, HasTheBacklogOfTheSimulation) {
  results::RunRecord run = record({setup::parse_executor("default", {})});
  EXPECT_EQ(stored(run).backlog, std::nullopt);
  run.simulation->max_backlog = 7;
  EXPECT_EQ(stored(run).backlog, 7U);
}

TEST_F(StoredSystemTest, HasTheThreadsOfItsDeployments) {
  graph_.platform.cores = 2;
  Deployment plan;
  plan.name = "two";
  plan.processes = {"a", "b"};
  for (const int processor : {1, 0}) {
    DeployedExecutor& e = plan.executors.emplace_back();
    e.name = "thread_" + std::to_string(processor);
    e.executor = "rm-ro:first";
    e.policy = {ThreadPolicy::Class::fifo, 10 + processor};
    e.processors = {processor};
    e.process = static_cast<std::uint32_t>(processor);
  }
  plan.executor_of.assign(tasks_.set.size(), 0);
  plan.executor_of.back() = 1;
  const setup::StoredSystem system = stored(record({setup::deploy(plan, {})}));
  const Deployment& read = system.executor("two").plan;
  EXPECT_EQ(read.executor_of, plan.executor_of);
  EXPECT_EQ(read.processes.size(), 2U);
  ASSERT_EQ(read.executors.size(), 2U);
  for (std::size_t e = 0; e < 2; ++e) {
    const DeployedExecutor& planned = plan.executors[e];
    EXPECT_THAT(read.executors[e], testing::FieldsAre(planned.name, planned.executor, planned.policy,
                                                      planned.processors, testing::_, planned.process));
  }
}

TEST_F(StoredSystemTest, AGraphThatHasChangedSinceIsRejected) {
  const results::RunRecord run = record({setup::parse_executor("default", {})});
  const auto stored_with = [&](auto&& change) {
    results::RunRecord changed = run;
    change(*std::ranges::find(changed.tasks.tasks, TaskKind::timer, &Task::kind));
    static_cast<void>(stored(changed));
  };
  const auto refused = [](const char* why) {
    return testing::ThrowsMessage<program::UsageError>(HasSubstr(why));
  };
  stored_with([](Task&) {});
  EXPECT_THAT([&] { stored_with([](Task& t) { t.wcet += 1ns; }); }, refused("an execution time"));
  EXPECT_THAT([&] { stored_with([](Task& t) { t.period += 1ns; }); }, refused("a period"));
  EXPECT_THAT([&] { stored_with([](Task& t) { t.deadline -= 1ns; }); }, refused("a deadline"));
}

}  // namespace hotpath::stored_system_test
