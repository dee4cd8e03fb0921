// SPDX-License-Identifier: Apache-2.0
// Results from the rows of a stored run, whose repetitions were measured in random order.
#include "results/stored_summary.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "hotpath/core/input_error.hpp"
#include "results/run_folder.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class StoredSummaryTest : public testing::Test {
 protected:
  StoredSummaryTest() {
    Task& timer = set_.tasks.emplace_back();
    timer.name = "A";
    timer.period = timer.deadline = 10ms;
    base_ = std::filesystem::temp_directory_path() / "hotpath_XXXXXX";
    if (mkdtemp(base_.data()) == nullptr) throw std::runtime_error("no folder");
    record_.simulation.emplace();
    record_.tasks = set_;
    record_.executors = {"default", "rm-ro"};
    record_.chains = {"c"};
  }
  ~StoredSummaryTest() override { std::filesystem::remove_all(base_); }

  /// A repetition with one job, which responds after as many nanoseconds, and one output.
  results::RepetitionRecord& ran(const char* executor, std::uint32_t repetition, std::int64_t response) {
    Trace& trace = traces_.emplace_back();
    trace.executor = executor;
    trace.repetition = repetition;
    JobRecord& r = trace.jobs.emplace_back();
    r.job.task = 0;
    r.finish = Time{} + Duration(response);
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
    results::RunFolder folder(base_ + "/run");
    for (const Trace& trace : traces_) folder.append(set_, {"c"}, trace);
    folder.close(record_, nlohmann::json::object());
    return {base_ + "/run", "RUN"};
  }

  std::string base_;
  TaskSet set_;
  std::vector<Trace> traces_;
  results::RunRecord record_;
};

TEST_F(StoredSummaryTest, ResponsesAreInTheOrderOfExecutorsAndRepetitions) {
  ran("rm-ro", 0, 4);
  ran("default", 1, 2);
  ran("default", 2, 3).replaced_by = 3;
  ran("default", 0, 1);
  const results::StoredRun stored = run();
  std::ostringstream out;
  results::ResponsesCsv csv(out, stored);
  results::for_each_record(stored, [&](const JobRow& row) { csv.add(row); });
  csv.finish();
  EXPECT_EQ(out.str(), "executor,repetition,task,response_ns\ndefault,0,A,1\ndefault,1,A,2\nrm-ro,0,A,4\n");
}

TEST_F(StoredSummaryTest, ReplacedRepetitionsDoNotCountAndDropsCountOnce) {
  ran("default", 0, 1).replaced_by = 1;
  ran("default", 1, 2);
  const results::StoredRun stored = run();
  const results::Summary summary = results::summarize(stored, stored.summary_options());
  EXPECT_EQ(summary.executors.at(0).executed, 1U);
  EXPECT_EQ(summary.executors[0].chains.at(0).hot_path.quantiles.n, 2U);
  EXPECT_EQ(summary.executors[0].chains[0].drops, 3U);
}

TEST_F(StoredSummaryTest, RowsOfARepetitionMustStandTogether) {
  ran("default", 0, 1);
  ran("default", 1, 2);
  traces_.push_back(traces_.front());
  const results::StoredRun stored = run();
  try {
    results::for_each_record(stored, [](const JobRow&) {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("jobs.csv:4: rows of default, repetition 0, have ended before"));
  }
}

/// The work of 4 ms takes twice as long in all repetitions but one, which has as little work.
TEST_F(StoredSummaryTest, SlowRepetitionsAreInOrder) {
  set_.tasks[0].wcet = 4ms;
  record_.tasks = set_;
  record_.simulation.reset();
  record_.live.emplace();
  record_.kind = results::RunKind::live;
  for (const std::uint32_t repetition : {2U, 0U, 1U}) {
    results::RepetitionRecord& stored = ran("default", repetition, 1);
    stored.expected["A"] = 100;
    traces_.back().jobs.clear();
    traces_.back().chains.clear();
    for (int i = 0; i < 100; ++i) {
      JobRecord& r = traces_.back().jobs.emplace_back();
      r.job.task = 0;
      r.job.sequence = static_cast<std::uint64_t>(i);
      r.job.timestamp = r.job.release = r.start = Time{} + i * 10ms;
      r.finish = r.start + (repetition == 1 ? 4ms : 8ms);
      r.cpu = 1;
    }
  }
  const results::StoredRun stored = run();
  const results::Summary summary = results::summarize(stored, stored.summary_options());
  const auto& slow = summary.executors.at(0).speed.slow;
  ASSERT_EQ(slow.size(), 2U);
  EXPECT_EQ(slow[0].repetition, 0U);
  EXPECT_EQ(slow[1].repetition, 2U);
}

}  // namespace
}  // namespace hotpath
