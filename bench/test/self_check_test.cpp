// SPDX-License-Identifier: Apache-2.0
// A recorded system against the simulation of its graph.
#include "import/stages.hpp"

#include <gtest/gtest.h>

#include "reference_nodes.hpp"

namespace hotpath::self_check_test {

using namespace std::chrono_literals;

/// A sensor of 10 ms, whose jobs work for 1 or 3 ms, and its reader.
class SelfCheckTest : public testing::Test {
 protected:
  SelfCheckTest() {
    graph_.nodes = {reference_node("S", NodeType::sensor, {}, 10ms, 3ms),
                    reference_node("C", NodeType::command, {{"S", 1, {}}}, {}, 1ms)};
    tasks_ = make_tasks(graph_);
    for (int i = 0; i < 100; ++i) {
      const Duration at = i * 10ms, end = at + length_of(i);
      add(0, i, at, at, end);
      add(1, i, end, end, end + 1ms).job.parent = {0, static_cast<std::uint64_t>(i)};
    }
    trace_.end = Time{} + 1s;
    trace_.published = {0, 100};
  }

  static Duration length_of(int i) { return i % 2 == 0 ? 1ms : 3ms; }

  JobRecord& add(TaskId task, int sequence, Duration timestamp, Duration start, Duration finish) {
    const Job job{task, static_cast<std::uint64_t>(sequence), Time{} + timestamp, Time{} + timestamp, kNever,
                  {}};
    trace_.jobs.push_back({job, Time{} + start, Time{} + finish});
    return trace_.jobs.back();
  }
  void lose(int samples, Duration at) {
    for (int i = 0; i < samples; ++i) add(1, 100 + i, at, 0ms, 0ms).outcome = Outcome::overwritten;
  }

  imports::SelfCheck check(const std::map<std::string, std::string>& doubted = {}) const {
    return imports::self_check(graph_, tasks_, setup::parse_executor("events-ro", {}), trace_, doubted);
  }

  Graph graph_;
  GraphTasks tasks_;
  Trace trace_;
};

TEST_F(SelfCheckTest, EachJobHasTheTimeOfItsMoment) {
  const imports::SelfCheck result = check();
  EXPECT_EQ(result.light, imports::Light::green);
  EXPECT_EQ(result.schedule.similarity, 1);
  int sensor_jobs = 0;
  for (const JobRecord& r : result.simulated.jobs) {
    if (r.job.task != 0 || r.outcome != Outcome::ran) continue;
    EXPECT_EQ(r.finish - r.start, length_of(sensor_jobs++));
  }
  EXPECT_GE(sensor_jobs, 99);
}

TEST_F(SelfCheckTest, LossesBeforeTheEpochDoNotCount) {
  lose(4, -5ms);
  EXPECT_EQ(check().lost_recorded_percent, 0);
  EXPECT_EQ(check().light, imports::Light::green);
  trace_.jobs.front().job.skipped = 50;
  EXPECT_EQ(check().lost_recorded_percent, 20) << "50 of 250 timestamps and samples";
}

TEST_F(SelfCheckTest, SomeDeviationIsYellowAndThreeTimesAsMuchIsRed) {
  lose(4, 5ms);
  EXPECT_EQ(check().light, imports::Light::yellow);
  lose(8, 5ms);
  EXPECT_EQ(check().light, imports::Light::red);
}

/// The simulated latencies are 1 and 3 ms.
TEST_F(SelfCheckTest, AMedianOfFewOutputsIsNotRed) {
  graph_.chains = {{"c", {"S", "C/S"}, {"S"}, "C/S"}};
  tasks_ = make_tasks(graph_);
  for (const std::uint64_t outputs : {19U, 100U}) {
    trace_.chains.clear();
    for (std::uint64_t i = 0; i < outputs; ++i)
      trace_.chains.push_back({.sequence = i, .hot_path_latency = 30ms, .sink = 1, .finish = Time{} + 1ms});
    EXPECT_EQ(check().light, outputs < 20 ? imports::Light::yellow : imports::Light::red) << outputs;
    EXPECT_EQ(check({{"c", "c is held."}}).reasons, std::vector<std::string>{"c is held."});
  }
}

TEST_F(SelfCheckTest, AMedianBetweenTwoModesIsAMatterOfFewOutputs) {
  graph_.chains = {{"c", {"S", "C/S"}, {"S"}, "C/S"}};
  tasks_ = make_tasks(graph_);
  for (const int slow : {49, 51, 60}) {  // of 100; simulated, one half has 1 ms, the other 3
    trace_.chains.clear();
    for (int i = 0; i < 100; ++i)
      trace_.chains.push_back({.sequence = static_cast<std::uint64_t>(i),
                               .hot_path_latency = i < slow ? 3ms : 1ms,
                               .sink = 1,
                               .finish = Time{} + 1ms});
    const imports::SelfCheck result = check();
    EXPECT_EQ(result.chains.front().between_modes, slow != 60);
    EXPECT_EQ(result.reasons.size(), slow == 60 ? 1 : 0) << slow << testing::PrintToString(result.reasons);
  }
}

}  // namespace hotpath::self_check_test
