// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <gmock/gmock.h>

#include <sstream>

namespace hotpath::summary_table_test {

using testing::HasSubstr;
using testing::Not;

results::LatencySummary latency(double scale) {
  results::LatencySummary l;
  l.quantiles = {
      .n = 1500, .max = 26.125 * scale, .p50 = 21.25 * scale, .p99 = 24 * scale, .p999 = 25.5 * scale};
  l.low = {.max = 25.25 * scale, .p50 = 21 * scale, .p99 = 23.5 * scale, .p999 = 25 * scale};
  l.high = {.max = 26.125 * scale, .p50 = 21.5 * scale, .p99 = 24.5 * scale, .p999 = 26 * scale};
  return l;
}

results::ExecutorSummary executor(std::string name, double scale) {
  results::ExecutorSummary e;
  e.executor = std::move(name);
  e.repetitions = 5;
  e.executed = 66000;
  e.overwritten = 12;
  e.cpu_per_callback_us = 38.125;
  results::ChainSummary chain;
  chain.chain = "hot_path";
  chain.hot_path = latency(scale / 2);
  chain.end_to_end = latency(scale);
  for (results::LatencySummary* l : {&chain.hot_path, &chain.end_to_end})
    l->to_default.fill(Estimate{scale / 2, Interval{scale / 2, scale / 2}});
  chain.interval_ms = quantiles({99, 101, 150});
  chain.disparity_ms = quantiles({0, 50});
  e.chains = {chain};
  return e;
}

results::Summary two_executors() {
  results::Summary s;
  s.executors = {executor("default", 2), executor("rm-ro", 1)};
  results::ChainSummary& base = s.executors[0].chains[0];
  for (results::LatencySummary* l : {&base.hot_path, &base.end_to_end})
    l->to_default.fill(Estimate{1.0, std::nullopt});
  return s;
}

std::string plain(const results::Summary& s) {
  std::ostringstream out;
  results::write_table(out, s);
  return out.str();
}

TEST(Table, LayoutOfAComparison) {
  std::ostringstream out;
  results::write_table(out, two_executors(), results::Detail::short_answer);
  EXPECT_EQ(
      out.str(),
      R"(hot_path: the data is youngest under rm-ro: at most 24.0 ms old in 99 of 100 outputs, 50 % less than
under default (48.0). Simulated: between -50 % and -50 %.

hot_path: age of the data in each output, in ms [95 % interval over repetitions] (difference to default)

                                                           hot path,
executor         median            p99          worst          worst  lost
--------------------------------------------------------------------------
default            42.5           48.0           52.2           26.1    12
            [42.0,43.0]    [47.0,49.0]    [50.5,52.2]    [25.2,26.1]
rm-ro     21.2 (-50 %)*  24.0 (-50 %)*  26.1 (-50 %)*  13.1 (-50 %)*    12
            [21.0,21.5]    [23.5,24.5]    [25.2,26.1]    [12.6,13.1]

Age: from the timestamp of the oldest source to the finish of the output. Hot path: from the start of
the latest source's callback to the start of the last one (the paper's metric). Lost: unused timestamps and samples.
* beyond noise: the confidence interval of the ratio to default (summary.json) excludes 1.
)");
}

TEST(Table, OfAllDetailsHasOutputsAndJobsAndStaysWithin120ColumnsForAWholeStudy) {
  results::Summary s = two_executors();
  EXPECT_THAT(plain(s), testing::ContainsRegex("default +1500 +101.0 +150.0 +50.0 +21.2 +24.0"));
  EXPECT_THAT(plain(s), testing::ContainsRegex("default +66000 +0 +12 +38.1 +0"));
  s.executors.push_back(executor("events-ro", 36));
  s.executors.push_back(executor("events-re", 0.01));
  for (results::ExecutorSummary& e : s.executors) {
    e.skipped = 123456;
    e.overwritten = 1234567;
    e.chains[0].hot_path.quantiles.n = 60000;
  }
  std::istringstream lines(plain(s));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
}

TEST(Table, MarksARatioWhoseIntervalLeavesOutOne) {
  results::Summary s = two_executors();
  s.executors[1].chains[0].end_to_end.to_default[results::kMedian] = Estimate{0.97, Interval{0.9, 1.02}};
  s.executors[1].chains[0].end_to_end.to_default[results::kP99] = Estimate{0.998, std::nullopt};
  s.executors[1].chains[0].end_to_end.to_default[results::kWorst] = Estimate{1.25, Interval{1.1, 1.4}};
  EXPECT_THAT(plain(s),
              testing::ContainsRegex("rm-ro +21.2 \\(-3 %\\) +24.0 \\(0 %\\) +26.1 \\(\\+25 %\\)\\* "));
}

TEST(Table, ShowsADashAndNoIntervalForWhatWasNotMeasured) {
  EXPECT_EQ(plain({}), "");
  results::Summary s;
  results::ExecutorSummary& e = s.executors.emplace_back();
  e.executor = "rm-ro";
  e.chains = {results::ChainSummary{}};
  EXPECT_THAT(plain(s), testing::ContainsRegex("rm-ro +- +- +- +- +0\n"));
  EXPECT_THAT(plain(s), Not(HasSubstr("[")));
}

TEST(Table, OfAGraphWithoutChainsShowsItsJobs) {
  results::Summary s = two_executors();
  for (results::ExecutorSummary& e : s.executors) {
    e.chains.clear();
    e.skipped = 44;
    e.after_warm_up.deadline_overruns = 7;
    e.tasks = {results::TaskSummary{}, results::TaskSummary{}};
    e.tasks[1].response_ms = quantiles({10, 76.5});
  }
  s.executors[1].tasks[0].response_authors_ms = quantiles({10, 31.5});
  EXPECT_THAT(plain(s), testing::ContainsRegex("default +66000 +44 +12 +38.1 +7 +76.5 +-\n"));
  EXPECT_THAT(plain(s), testing::ContainsRegex("rm-ro +66000 +44 +12 +38.1 +7 +76.5 +31.5\n"));
}

TEST(Table, NamesEveryBrokenLossEquationOrHowManyMoreThereAre) {
  results::Summary s = two_executors();
  EXPECT_THAT(plain(s), Not(HasSubstr("Loss equation")));
  for (std::uint32_t k = 0; k < 5; ++k) s.executors[1].unbalanced.push_back({k, "IMU", 99, 100});
  EXPECT_THAT(plain(s), HasSubstr("rm-ro, repetition 0, IMU: 99 accounted for, 100 expected.\n"));
  EXPECT_THAT(plain(s), HasSubstr("rm-ro, 2 more"));
}

TEST(Table, TellsOfLostRecordsAndDropsOnTheHotPath) {
  results::Summary s = two_executors();
  s.executors[0].lost_records = 17;
  s.executors[1].chains[0].drops = 3;
  EXPECT_THAT(plain(s), HasSubstr("default had no room for 17 records"));
  EXPECT_THAT(plain(s), HasSubstr("rm-ro replaced 3 samples along hot_path"));
}

TEST(Table, NamesTheTasksThatStarvedTheWorstFirst) {
  results::Summary s = two_executors();
  const auto timer = [](std::string name, int wait_ms) {
    results::TaskSummary task;
    task.task = std::move(name);
    task.period = std::chrono::milliseconds(100);
    task.longest_wait = std::chrono::milliseconds(wait_ms);
    task.account.count[static_cast<std::size_t>(Outcome::ran)] = wait_ms > 0;
    task.account.count[static_cast<std::size_t>(Outcome::queued)] = 1;
    return task;
  };
  s.executors[0].tasks = {timer("IMU", 100), timer("Camera", 150), timer("Lidar", 0), timer("Map", 250),
                          timer("Radar", 0)};
  s.executors[0].tasks.back().busy_share = 0.6;  // its own work leaves no time for more
  s.executors[1].tasks.assign(12, timer("Camera", 101));
  EXPECT_THAT(plain(s), HasSubstr("\ndefault: Lidar never ran\ndefault: Radar never ran\n"
                                  "default: Map waited up to 250.0 ms (period 100 ms)\n"
                                  "default: Camera waited up to 150.0 ms (period 100 ms)\nrm-ro"));
  EXPECT_THAT(plain(s), HasSubstr("rm-ro: and 2 more, see summary.json\n"));
  EXPECT_THAT(results::verdict(s).front(),
              testing::EndsWith(
                  "Simulated, 5 repetitions. Left out, as outputs are missing or tasks starve: default."));
  EXPECT_THAT(plain(s), Not(HasSubstr("IMU")));
}

TEST(Verdict, LeavesOutAnExecutorThatLacksMoreThanFivePercentOfTheOutputs) {
  results::Summary s = two_executors();
  for (const std::size_t outputs : {1425U, 1424U}) {
    s.executors[0].chains[0].end_to_end.quantiles.n = outputs;
    const bool left_out = results::verdict(s).front().find("Left out") != std::string::npos;
    EXPECT_EQ(left_out, outputs < 1425) << "of 1500";
  }
}

TEST(Table, NumbersHaveThreeDigitsAfterRounding) {
  for (const auto& [value, text] :
       {std::pair(0.12345, "0.123"), std::pair(0.9996, "1.00"), std::pair(9.996, "10.0"),
        std::pair(999.4, "999.4"), std::pair(999.96, "1000"), std::pair(12345.6, "12346")}) {
    results::Summary s = two_executors();
    s.executors[1].cpu_per_callback_us = value;
    EXPECT_THAT(plain(s), testing::ContainsRegex("rm-ro +66000 +0 +12 +" + std::string(text) + " +0 "))
        << value;
  }
}

TEST(Table, HasTheTimerWhosePeriodVariesMost) {
  results::Summary s = two_executors();
  for (const auto& [name, range] : {std::pair("IMU", 2.0), std::pair("Camera", 5.0), std::pair("Map", 3.0)}) {
    results::TaskSummary& timer = s.executors[0].tasks.emplace_back();
    timer.task = name;
    timer.period = std::chrono::milliseconds(100);
    timer.account.count[static_cast<std::size_t>(Outcome::ran)] = 1;
    timer.period_ms = quantiles({100 - range, 100.0, 100.0});
    timer.period_deviation_ms = quantiles({range, 0.0, 0.0});
  }
  EXPECT_THAT(plain(s), testing::ContainsRegex("default +Camera +100.0 +95.0 +100.0 +4.90\n"));
  EXPECT_THAT(plain(s), Not(HasSubstr("IMU")));
}

}  // namespace hotpath::summary_table_test
