// SPDX-License-Identifier: Apache-2.0
// Deployments whose worst cases are published, or can be worked out by hand.
#include "hotpath/analysis/deployment_bounds.hpp"

#include <gmock/gmock.h>

namespace hotpath::deployment_bounds_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;
using namespace std::chrono_literals;

/// A graph and its deployment, built task by task; times in ns.
class Deployed {
 public:
  std::uint32_t thread(int priority, const char* executor = "default", unsigned processor = 0) {
    DeployedThread thread;
    thread.name = "thread" + std::to_string(threads_.size());
    thread.executor = find_executor(executor);
    thread.priority = priority;
    thread.timers_priority = 99;
    thread.processors = {processor};
    threads_.push_back(thread);
    return static_cast<std::uint32_t>(threads_.size() - 1);
  }
  DeployedThread& last_thread() { return threads_.back(); }

  TaskId timer(std::uint32_t thread, int period, int wcet, int bcet = -1) {
    Task task;
    task.kind = TaskKind::timer;
    task.period = task.deadline = Duration(period);
    return add(task, thread, wcet, bcet);
  }
  TaskId subscription(std::uint32_t thread, const std::vector<TaskId>& publishers, int wcet, int bcet = -1) {
    Task task;
    task.kind = TaskKind::subscription;
    const TaskId id = add(task, thread, wcet, bcet);
    for (const TaskId publisher : publishers) graph_.set.tasks[publisher].feeds.push_back(id);
    return id;
  }
  Task& operator[](TaskId id) { return graph_.set.tasks[id]; }
  CallbackGraph& graph() { return graph_; }
  Platform& platform() { return platform_; }

  GraphBounds bounds() {
    graph_.reads.resize(graph_.set.size());
    graph_.every.assign(graph_.set.size(), 1);
    return deployment_bounds({graph_, threads_, thread_of_, platform_});
  }
  std::vector<std::int64_t> responses() {
    std::vector<std::int64_t> all;
    for (const std::optional<std::int64_t>& bound : bounds().tasks) all.push_back(bound.value_or(-1));
    return all;
  }

 private:
  TaskId add(Task task, std::uint32_t thread, int wcet, int bcet) {
    task.name = "task" + std::to_string(graph_.set.size());
    task.wcet = Duration(wcet);
    task.bcet = Duration(bcet < 0 ? wcet : bcet);
    graph_.set.tasks.push_back(task);
    thread_of_.push_back(thread);
    return graph_.set.size() - 1;
  }

  CallbackGraph graph_;
  std::vector<DeployedThread> threads_;
  std::vector<std::uint32_t> thread_of_;
  Platform platform_;
};

/// Each timer has a thread of its own; the first has the highest priority.
std::vector<std::int64_t> preemptive(const std::vector<std::pair<int, int>>& wcet_and_period) {
  Deployed system;
  int priority = 50;
  for (const auto& [wcet, period] : wcet_and_period) system.timer(system.thread(priority--), period, wcet);
  return system.responses();
}

TEST(DeploymentBounds, ThreadsOfOneTimerAreClassicalResponseTimeAnalysis) {
  // Burns and Wellings, "Real-Time Systems and Programming Languages", response-time analysis.
  EXPECT_THAT(preemptive({{3, 7}, {3, 12}, {5, 20}}), ElementsAre(3, 6, 20));
  // Lehoczky 1990, "Fixed priority scheduling of periodic task sets with arbitrary deadlines": the fifth
  // job of the second task is the worst.
  EXPECT_THAT(preemptive({{26, 70}, {62, 100}}), ElementsAre(26, 118));
  // schedcat, the test of preemptive fixed-priority response times.
  EXPECT_THAT(preemptive({{1, 4}, {1, 5}, {3, 9}, {3, 18}}), ElementsAre(1, 2, 7, 18));
  EXPECT_THAT(preemptive({{5, 10}, {6, 10}}), ElementsAre(5, -1)) << "overloaded";
}

TEST(DeploymentBounds, EqualPrioritiesTakeTurnsInAnyOrder) {
  Deployed system;
  system.timer(system.thread(5), 20, 3);
  system.timer(system.thread(5), 30, 4);
  system.timer(system.thread(1), 50, 1);
  EXPECT_THAT(system.responses(), ElementsAre(7, 7, 8));
}

TEST(DeploymentBounds, AnExecutorsJobsBlockEachOtherButNoMoreUrgentThread) {
  Deployed system;
  const std::uint32_t high = system.thread(2), low = system.thread(1, "fp-ro");
  system.timer(high, 8, 1);
  system[system.timer(low, 9, 2)].priority = 1;
  system[system.timer(low, 40, 6)].priority = 2;
  // The second waits for the third (6), and two jobs of the first; the third starts behind one job of each of
  // the others, and is then preempted by the first alone (a preemptive thread would take 12).
  EXPECT_THAT(system.responses(), ElementsAre(1, 10, 10));
}

TEST(DeploymentBounds, AJobOfALessUrgentThreadBeginsAWindowByItsPublication) {
  Deployed system;
  const std::uint32_t high = system.thread(2), low = system.thread(1);
  const TaskId timer = system.timer(high, 100, 3);
  const TaskId source = system.timer(low, 100, 5);
  system.subscription(high, {source}, 4);
  EXPECT_THAT(system.bounds().tasks[timer], Optional(7));
}

TEST(DeploymentBounds, SamplesFromAnotherProcessorHaveJitter) {
  Deployed system;
  const std::uint32_t there = system.thread(1, "default", 1), high = system.thread(2), low = system.thread(1);
  const TaskId source = system.timer(there, 10, 2, 0);
  const TaskId behind = system.subscription(high, {source}, 2);
  system.timer(low, 50, 10);
  system.graph().chains.push_back({"chain", {source}, {behind}});
  const GraphBounds bounds = system.bounds();
  // Samples come 0 to 2 after their timestamps, so that two may come within 14, 8 apart.
  EXPECT_THAT(bounds.tasks, ElementsAre(Optional(2), Optional(2), Optional(14)));
  EXPECT_EQ(bounds.chains.at(0).value().latency, 4);
  EXPECT_THAT(bounds.chains.at(0).value().hot_path, Optional(2));
}

TEST(DeploymentBounds, ProcessorsThatActivateEachOtherReachAFixedPoint) {
  // source (0) -> middle (1) -> sink (0); the sink's thread preempts the source's.
  Deployed system;
  const std::uint32_t low = system.thread(1), there = system.thread(1, "default", 1), high = system.thread(2);
  const TaskId source = system.timer(low, 10, 2, 1);
  const TaskId middle = system.subscription(there, {source}, 3, 1);
  const TaskId sink = system.subscription(high, {middle}, 1);
  system.graph().chains.push_back({"chain", {source}, {sink}});
  const GraphBounds bounds = system.bounds();
  EXPECT_THAT(bounds.tasks, ElementsAre(Optional(3), Optional(3), Optional(1)));
  EXPECT_EQ(bounds.chains.at(0).value().latency, 3 + 3 + 1);
}

TEST(DeploymentBounds, TasksOfTheOrdinaryClassHaveNoBoundAndHoldNobodyUp) {
  Deployed system;
  const std::uint32_t fifo = system.thread(1), ordinary = system.thread(0);
  system.timer(fifo, 10, 3);
  const TaskId other = system.timer(ordinary, 10, 9);
  system.graph().chains.push_back({"chain", {other}, {other}});
  const GraphBounds bounds = system.bounds();
  EXPECT_THAT(bounds.tasks, ElementsAre(Optional(3), std::nullopt));
  EXPECT_THAT(bounds.no_chain_bound.at(0), HasSubstr("ordinary scheduling class"));
}

TEST(DeploymentBounds, SamplesThatMayComeAtAnyTimeLeaveTheirThreadWithoutBound) {
  Deployed system;
  const std::uint32_t ordinary = system.thread(0);
  system.last_thread().processors = {0, 1};
  const std::uint32_t above = system.thread(3), reached = system.thread(2);
  const TaskId source = system.timer(ordinary, 10, 1);
  const TaskId more_urgent = system.timer(above, 10, 3);
  const TaskId behind = system.subscription(reached, {source}, 1);
  const TaskId less_urgent = system.timer(system.thread(1), 10, 1);
  const GraphBounds bounds = system.bounds();
  EXPECT_THAT(bounds.tasks[more_urgent], Optional(3));
  EXPECT_EQ(bounds.tasks[behind], std::nullopt);
  EXPECT_EQ(bounds.tasks[less_urgent], std::nullopt);
}

TEST(DeploymentBounds, AJoinOnAnotherProcessorPublishesOncePerSetOfInputs) {
  Deployed system;
  const std::uint32_t there = system.thread(1, "default", 1), high = system.thread(2), low = system.thread(1);
  const TaskId a = system.timer(there, 100, 1), b = system.timer(there, 100, 1);
  const TaskId left = system.subscription(there, {a}, 1), right = system.subscription(there, {b}, 1);
  system.subscription(high, {left, right}, 10);
  const TaskId victim = system.timer(low, 1000, 300);
  system.graph().joins.push_back({{left, right}});
  // Five outputs: a late one, and four in the 350 behind it. With an output for each input it would take 380.
  EXPECT_THAT(system.bounds().tasks[victim], Optional(350));
}

TEST(DeploymentBounds, CostsComeBeforeJobsAndWakeUpsBeforeThreads) {
  Deployed system;
  const std::uint32_t first = system.thread(2), second = system.thread(1, "fp-ro");
  const TaskId source = system.timer(first, 1000, 10);
  system.subscription(second, {source}, 20);
  system.platform().set_dispatch_costs(1ns);
  system.platform().wait_cost = 2ns;
  EXPECT_THAT(system.responses(), ElementsAre(13, 26));  // the sample may be published 10 after the timestamp
  // Two wake-ups before the timer's job, one before the subscription's. The timer's next job may come
  // between.
  system.platform().wake_up_latency = 5ns;
  const GraphBounds bounds = system.bounds();
  EXPECT_THAT(bounds.tasks[source], Optional(23));
  EXPECT_THAT(bounds.tasks[1], Optional(5 + 23 + 13));
}

TEST(DeploymentBounds, ASampleMayArriveLateOnItsOwnProcessor) {
  Deployed system;
  const std::uint32_t high = system.thread(3), middle = system.thread(2), low = system.thread(1);
  const TaskId source = system.timer(high, 100, 3);
  const TaskId behind = system.subscription(middle, {source}, 2);
  system.timer(low, 100, 20);
  system.graph().chains.push_back({"chain", {source}, {behind}});
  system.platform().delivery_delay = 4ns;
  const GraphBounds bounds = system.bounds();
  // The source may run again behind the arrival. The last thread may run while the sample is on its way, but
  // delays neither job.
  EXPECT_THAT(bounds.tasks, ElementsAre(Optional(3), Optional(4 + 3 + 2), Optional(3 + 2 + 20)));
  EXPECT_EQ(bounds.chains.at(0).value().latency, 3 + 4 + 3 + 2);
  EXPECT_THAT(bounds.chains.at(0).value().hot_path, Optional(3 + 4 + 3));
}

TEST(DeploymentBounds, WhatIsNotCoveredIsRefusedByName) {
  const auto refusal = [](const char* executor, const auto& change) {
    Deployed system;
    system.timer(system.thread(5, executor), 10, 1);
    change(system);
    return system.bounds().refusal.value_or("");
  };
  const auto as_it_is = [](Deployed&) {};
  EXPECT_EQ(refusal("default", as_it_is), "");
  EXPECT_THAT(refusal("multi", as_it_is), HasSubstr("several executor threads"));
  EXPECT_THAT(refusal("rm-re", as_it_is), HasSubstr("runs timers itself"));
  EXPECT_THAT(refusal("default", [](Deployed& s) { s.thread(0, "rm-re"); }),  // its timer thread is above
              HasSubstr("executor thread1: it does not cover a timer thread"));
  EXPECT_EQ(refusal("default", [](Deployed& s) { s.thread(0, "multi"); }), "");
  EXPECT_THAT(refusal("default", [](Deployed& s) { s.last_thread().processors.push_back(1); }),
              HasSubstr("several processors"));
  EXPECT_THAT(refusal("default", [](Deployed& s) { s.last_thread().priority = 0; }),
              HasSubstr("no executor"));
  EXPECT_THAT(refusal("default", [](Deployed& s) { s.last_thread().other_policy = "rr:5"; }),
              HasSubstr("rr:5"));
  EXPECT_THAT(refusal("events-ro", [](Deployed& s) { s.last_thread().timers_priority = 5; }),
              HasSubstr("does not preempt it"));
  EXPECT_THAT(refusal("cbg", [](Deployed& s) { s.platform().wake_up_latency = 1ns; }), HasSubstr("wakes up"));
  const auto with_cost = [](Deployed& s) { s.platform().release_cost = 1ns; };
  EXPECT_EQ(refusal("default", with_cost), "");
  EXPECT_THAT(refusal("events-ro", with_cost), HasSubstr("release costs"));
  EXPECT_THAT(refusal("default", [](Deployed& s) { s[0].release_jitter = 1ns; }),
              HasSubstr("release jitter"));
}

}  // namespace hotpath::deployment_bounds_test
