// SPDX-License-Identifier: Apache-2.0
// The watcher on simulated runs: no false alarm, and a planted fault is named.
#include "watched_runs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "hotpath/reference_system/reference_node.hpp"

namespace hotpath::test {
namespace {

using namespace std::chrono_literals;

ReferenceNode sensor(const std::string& name, Duration period, Duration execution_time,
                     const std::string& output) {
  ReferenceNode sensor;
  sensor.type = NodeType::sensor;
  sensor.name = name;
  sensor.period = sensor.deadline = period;
  sensor.execution_time = sensor.best_case_execution_time = execution_time;
  sensor.outputs = {output};
  return sensor;
}

ReferenceNode transform(const std::string& input, Duration execution_time) {
  ReferenceNode transform = sensor("filter", {}, execution_time, "filtered");
  transform.type = NodeType::transform;
  transform.inputs.resize(1);
  transform.inputs.front().topic = input;
  transform.inputs.front().depth = 1;
  return transform;
}

void expect_calm(const Graph& graph, const std::string& executor) {
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const CaseResult result = check_watched(graph, executor, seed, false);
    ASSERT_EQ(result.wrong, "") << executor;
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 0U);
}

// While 40 ms of work last 100 ms, the timer thread pays for ten releases: as many as in the time of its own
// jobs, not in that of the work alone.
TEST(ReleaseAndExecute, BudgetsCountTheReleasesDuringTheJobsOfTheTimerThread) {
  Graph graph;
  graph.platform.release_cost = 1ms;
  graph.nodes = {sensor("slow", 200ms, 0ms, "slow"), sensor("fast", 10ms, 5ms, "fast"),
                 transform("slow", 40ms)};
  for (const char* executor : {"rm-re", "edf-re", "fp-re"}) expect_calm(graph, executor);
}

// Both timers publish at one instant, at which the other thread takes the first sample between them.
TEST(ReleaseAndExecute, KeepsTheOrderOfThreadsAtOneInstant) {
  Graph graph;
  graph.platform.cores = 2;
  graph.nodes = {sensor("one", 10ms, 0ms, "points"), sensor("two", 10ms, 0ms, "points"),
                 transform("points", 1ms)};
  for (const char* executor : {"events-re", "rm-re"}) expect_calm(graph, executor);
}

class Watched : public testing::TestWithParam<Property> {};

TEST_P(Watched, NamesFaultsAndNothingElse) {
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < GetParam().cases; ++seed) {
    const CaseResult result = GetParam().check(seed);
    ASSERT_EQ(result.wrong, "");
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 0U);
}

std::string name_of(const testing::TestParamInfo<Property>& info) {
  std::string name = info.param.name;
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, Watched, testing::ValuesIn(properties()), name_of);

}  // namespace
}  // namespace hotpath::test
