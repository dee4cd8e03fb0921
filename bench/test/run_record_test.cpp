// SPDX-License-Identifier: Apache-2.0
// The record of a run: what it keeps of a repetition, and of tasks.
#include "results/run_record.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "results/summary.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Pair;
using testing::UnorderedElementsAre;

TaskSet timer_and_subscription() {
  TaskSet set;
  set.groups = {CallbackGroup::mutually_exclusive, CallbackGroup::reentrant};
  set.tasks.resize(2);
  set.tasks[0].name = "Lidar";
  set.tasks[0].period = set.tasks[0].deadline = 100ms;
  set.tasks[0].phase = 3ms;
  set.tasks[1].name = "Filter/points";
  set.tasks[1].kind = TaskKind::subscription;
  set.tasks[1].group = 1;
  return set;
}

TEST(RunRecord, KeepsTheLossesOfARepetition) {
  results::Repetition repetition;
  repetition.trace.executor = "rm-ro";
  repetition.trace.repetition = 4;
  repetition.trace.lost_records = 17;
  repetition.trace.chains.resize(3);
  for (std::uint32_t i = 0; i < 3; ++i) repetition.trace.chains[i].dropped = i + 1;
  repetition.trace.chains[2].chain = 1;
  const results::RepetitionRecord record =
      results::record_of(timer_and_subscription(), {"hot_path", "other", "silent"}, repetition);
  EXPECT_EQ(record.repetition, 4U);
  EXPECT_EQ(record.lost_records, 17U);
  EXPECT_THAT(record.hot_path_drops,
              UnorderedElementsAre(Pair("hot_path", 3), Pair("other", 3), Pair("silent", 0)));
  EXPECT_THAT(record.first_timestamps, UnorderedElementsAre(Pair("Lidar", 3ms)));
}

TEST(RunRecord, TasksAreReadAsTheyWereWritten) {
  results::RunRecord record;
  record.simulation.emplace();
  record.tasks = timer_and_subscription();
  const nlohmann::json stored = record;
  const auto read = stored.get<results::RunRecord>();
  const auto group = [](const TaskSet& set, TaskId id) { return set.groups[set[id].group]; };
  ASSERT_EQ(read.tasks.size(), 2U);
  EXPECT_EQ(group(read.tasks, 0), CallbackGroup::mutually_exclusive);
  EXPECT_EQ(group(read.tasks, 1), CallbackGroup::reentrant);
  EXPECT_EQ(read.tasks[0].period, 100ms);
  EXPECT_EQ(read.tasks[1].kind, TaskKind::subscription);
}

TEST(RunRecord, TheUsageOfARepetitionIsReadAsItWasWritten) {
  const results::ProcessUsage usage{3ms, 2000, 4, 5, 6ms, 7ms, 8ms, 9ms};
  nlohmann::json stored = usage;
  EXPECT_THAT(stored.get<results::ProcessUsage>(), testing::FieldsAre(3ms, 2000, 4, 5, 6ms, 7ms, 8ms, 9ms));
  stored.erase("throttled_ms");
  stored.erase("others_ms");
  EXPECT_EQ(stored.get<results::ProcessUsage>().wall, 9ms) << "of an older version";
}

TEST(RunRecord, ATimerWithoutAPeriodAndATaskOfNoKindAreRejected) {
  results::RunRecord record;
  record.simulation.emplace();
  record.tasks = timer_and_subscription();
  const nlohmann::json good = record;
  for (const auto& [change, says] : {std::pair(R"({"period_ns": 0})", "`period_ns` of Lidar is 0"),
                                     std::pair(R"({"kind": "waitable"})", "`kind` is `waitable`")}) {
    nlohmann::json stored = good;
    stored["tasks"][0].update(nlohmann::json::parse(change));
    EXPECT_THAT([&] { stored.get<results::RunRecord>(); },
                testing::ThrowsMessage<std::out_of_range>(HasSubstr(says)));
  }
}

}  // namespace
}  // namespace hotpath
