// SPDX-License-Identifier: Apache-2.0
// Results from the rows of a stored run, whose repetitions were measured in random order.
#include "results/stored_summary.hpp"

#include <gmock/gmock.h>

#include <sstream>

#include "graph_fixture.hpp"
#include "program/errors.hpp"
#include "results/perfetto.hpp"
#include "results/run_folder.hpp"

namespace hotpath::stored_summary_test {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::FieldsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class StoredSummaryTest : public testing::Test {
 protected:
  StoredSummaryTest() {
    Task& timer = set_.tasks.emplace_back();
    timer.name = "A";
    timer.period = timer.deadline = 10ms;
    record_.simulation.emplace();
    record_.tasks = set_;
    record_.executors = {"default", "rm-ro"};
    record_.chains = {"c"};
  }

  /// A repetition with one job, which responds after as many nanoseconds, and one output.
  results::RepetitionRecord& ran(const char* executor, std::uint32_t repetition, std::int64_t response) {
    Trace& trace = traces_.emplace_back();
    trace.executor = executor;
    trace.repetition = repetition;
    trace.jobs.push_back({{0, 0, {}, {}, kNever, {}}, {}, Time{} + Duration(response)});
    trace.chains = {{0, 0, 0, Duration(response), Duration(response)},
                    {0, 1, 0, Duration(response), Duration(response)}};
    results::RepetitionRecord& stored = record_.runs.emplace_back();
    stored.executor = executor;
    stored.repetition = repetition;
    stored.expected["A"] = 1;
    stored.hot_path_drops["c"] = 3;
    return stored;
  }

  results::StoredRun run() {
    results::RunFolder folder(folder_.path() / "run");
    for (const Trace& trace : traces_) folder.append(set_, {"c"}, trace);
    folder.close(record_, nlohmann::json::object());
    return {folder_.path() / "run", "RUN"};
  }

  const Folder folder_;
  TaskSet set_;
  std::vector<Trace> traces_;
  results::RunRecord record_;
};

TEST_F(StoredSummaryTest, ResponsesAreOfRepetitions) {
  ran("rm-ro", 0, 4);
  ran("default", 1, 2);
  ran("default", 0, 1);
  const results::StoredRun stored = run();
  EXPECT_EQ(nlohmann::json(results::response_samples(stored)), nlohmann::json::parse(R"([
    {"name": "A", "executor": "rm-ro", "repetition": 0, "response_ms": [4e-6]},
    {"name": "A", "executor": "default", "repetition": 1, "response_ms": [2e-6]},
    {"name": "A", "executor": "default", "repetition": 0, "response_ms": [1e-6]}])"));
}

TEST_F(StoredSummaryTest, PerfettoGetsTheJobsThatRanOrWereLostInAWindow) {
  ran("default", 1, 2);
  ran("default", 0, 1);
  std::vector<JobRecord>& jobs = traces_.back().jobs;
  jobs.clear();
  const auto add = [&](Duration ready, Duration start, Duration finish, Outcome outcome) {
    const Job job{0, jobs.size(), Time{} + ready, Time{} + ready, Time{} + 12ms, {}};
    jobs.push_back({job, Time{} + start, Time{} + finish, Duration(-1), outcome});
  };
  add(0ms, 1ms, 9ms, Outcome::ran);
  add(0ms, 1ms, 10ms, Outcome::ran);
  add(0ms, 12ms, 13ms, Outcome::ran);
  add(15ms, 0ms, 0ms, Outcome::overwritten);
  add(20ms, 20ms, 21ms, Outcome::ran);
  jobs[2].job.parent = {0, 1};
  const results::StoredRun stored = run();
  const auto names = [&](Duration from, Duration to) {
    std::ostringstream out;
    results::write_perfetto(out, stored, {"default", 0, Time{} + from, Time{} + to});
    const nlohmann::json trace = nlohmann::json::parse(out.str());
    std::string all;
    for (const nlohmann::json& event : trace.at("traceEvents")) {
      const std::string phase = event.at("ph");
      if (phase == "X") all += event.at("args").at("sequence").dump();
      all += phase == "i" ? event.at("cat").get<std::string>() + " " : phase == "M" ? "" : phase + " ";
    }
    return all;
  };
  EXPECT_EQ(names(10ms, 20ms), "1X s 2X deadline missed f overwritten ");
  EXPECT_EQ(names(11ms, 15ms), "2X deadline missed ");
  EXPECT_EQ(names(0ms, 1ms), "");
}

TEST_F(StoredSummaryTest, DropsCountOnceInEachRepetition) {
  ran("default", 1, 2);
  ran("default", 0, 1);
  record_.seed = 7;
  const results::StoredRun stored = run();
  EXPECT_EQ(stored.summary_options().bootstrap.seed, 7U);
  const results::Summary summary = results::summarize(stored, stored.summary_options());
  EXPECT_EQ(summary.executors.at(0).executed, 2U);
  EXPECT_EQ(summary.executors[0].chains.at(0).hot_path.quantiles.n, 4U);
  EXPECT_EQ(summary.executors[0].chains[0].drops, 6U);
}

TEST_F(StoredSummaryTest, MarksWhatTheKernelCountedInEachRepetition) {
  const auto usage = [&](std::uint32_t repetition, Duration stolen, Duration throttled, Duration others) {
    ran("default", repetition, 1).usage = {0ms, 0, 0, 0, stolen, throttled, others, 10s};
  };
  usage(2, 60ms, 0ms, 600ms);
  usage(1, 50ms, 50ms, 500ms);  // at each limit
  usage(0, 0ms, 51ms, 0ms);
  const results::StoredRun stored = run();
  const results::Summary summary = results::summarize(stored, stored.summary_options());
  EXPECT_THAT(summary.executors.at(0).disturbed,
              ElementsAre(FieldsAre(0U, ElementsAre("0.5 % of the time throttled by a quota or by heat")),
                          FieldsAre(2U, ElementsAre("0.6 % of the time stolen by the hypervisor",
                                                    "6.0 % of the time used by other processes"))));
  EXPECT_EQ(summary.executors[0].executed, 3U) << "they count";
}

TEST_F(StoredSummaryTest, FirstTimestampsAreThoseOfTheTimersOfTheGraph) {
  ran("default", 0, 1).first_timestamps = {{"A", 3ms}};
  ran("default", 1, 1).first_timestamps = {{"A", 3ms}, {"B", 4ms}};
  const results::StoredRun stored = run();
  EXPECT_THAT(stored.first_timestamps(set_, "default", 0), ElementsAre(3ms));
  EXPECT_THAT([&] { static_cast<void>(stored.first_timestamps(set_, "default", 1)); },
              ThrowsMessage<program::UsageError>(HasSubstr("for 2 timers, the graph has 1")));
}

}  // namespace hotpath::stored_summary_test
