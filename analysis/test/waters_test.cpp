// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "hotpath/analysis/waters_statistics.hpp"
#include "task_sets.hpp"

namespace hotpath::waters_test {

const std::vector<WatersMethod> kAll = {WatersMethod::brueggen_davare, WatersMethod::davis_davare,
                                        WatersMethod::davis_duerr, WatersMethod::davis_kloda,
                                        WatersMethod::davis_guenzel};

TEST(Waters2015, RunnablesHaveSharesAndMeanExecutionTimesOfTheFacts) {
  constexpr int kRunnables = 300'000;
  RandomStream random(9, {0});
  std::map<std::int64_t, std::pair<int, double>> wcet_us;  // by period in ms: count, sum
  PeriodicTasks all;
  for (int i = 0; i < kRunnables; ++i) {
    all.push_back(waters_runnable(random));
    auto& [number, sum] = wcet_us[all.back().period / kMs];
    ++number;
    sum += static_cast<double>(all.back().wcet) / 1000;
  }
  const std::map<std::int64_t, double> mean_us = {{1, 73.8},  {2, 43.3},   {5, 111},   {10, 161},  {20, 74.5},
                                                  {50, 77.4}, {100, 53.6}, {200, 8.0}, {1000, 1.4}};
  for (const WatersPeriod& p : kWatersPeriods) {
    const auto& [number, sum] = wcet_us.at(p.period_ms);
    EXPECT_NEAR(number, p.share / 85 * kRunnables, 4 * std::sqrt(p.share / 85 * kRunnables))
        << p.period_ms << " ms";
    EXPECT_NEAR(sum / number / mean_us.at(p.period_ms), 1, 0.04) << p.period_ms << " ms";
  }
  EXPECT_NEAR(utilisation(all) / kRunnables, 0.00965, 0.00965 * 0.02);
}

TEST(Waters2015, TaskSetsReachTheirUtilisationInRateMonotonicOrder) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    RandomStream random(9, {i});
    const double target = 0.6 + 0.1 * static_cast<double>(i % 4);
    const PeriodicTasks tasks = waters_task_set(target, random);
    EXPECT_GE(utilisation(tasks), target);
    EXPECT_LE(utilisation(tasks), target + 0.01 + 1e-12);
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      EXPECT_EQ(tasks[k].deadline, tasks[k].period);
      EXPECT_LE(tasks[k > 0 ? k - 1 : 0].period, tasks[k].period);
    }
  }
}

TEST(Waters2015, ChainsFollowTheAuthorsProcedure) {
  std::map<std::size_t, int> length, patterns;
  int chains_in_all = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    RandomStream random(10, {i});
    const PeriodicTasks tasks = waters_task_set(0.8, random);
    const std::vector<TaskChain> chains = waters_chains(tasks, random);
    EXPECT_LE(chains.size(), 59U);
    for (const TaskChain& chain : chains) {
      ++chains_in_all;
      EXPECT_GE(chain.size(), 2U);
      EXPECT_LE(chain.size(), 15U);
      EXPECT_EQ(std::set<std::size_t>(chain.begin(), chain.end()).size(), chain.size()) << "a task repeats";
      std::map<std::int64_t, int> of_period;
      for (const std::size_t k : chain) ++of_period[tasks.at(k).period];
      EXPECT_LE(of_period.size(), 3U);
      for (const auto& [period, number] : of_period) {
        EXPECT_GE(number, 2);
        EXPECT_LE(number, 5);
      }
      ++patterns[of_period.size()];
      ++length[chain.size()];
    }
  }
  // Attempts with more patterns are dropped more often: the share of one pattern exceeds its 70 %.
  EXPECT_GT(patterns[1], 0.7 * chains_in_all);
  EXPECT_GT(patterns[2], patterns[3]);
  EXPECT_GT(patterns[3], 0);
  EXPECT_GT(length[3], length[2]);
}

TEST(RandomStream, ShufflesIntoAllOrdersEquallyOften) {
  RandomStream random(1, {});
  std::map<std::array<int, 3>, int> seen;
  for (int i = 0; i < 60'000; ++i) {
    std::array<int, 3> order = {1, 2, 3};
    random.shuffle(std::span<int>(order));
    ++seen[order];
  }
  for (const auto& [_, count] : seen) EXPECT_NEAR(count, 10'000, 400);
}

TEST(Waters2015, FewerThanThreePeriodsGiveNoChains) {
  RandomStream random(1, {0});
  PeriodicTasks tasks;
  for (int i = 0; i < 10; ++i) tasks.push_back(task(1, i < 5 ? 10 : 20));
  EXPECT_TRUE(waters_chains(tasks, random).empty());
}

TEST(Waters2015, ImpossibleUtilisationIsRefused) {
  RandomStream random(1, {0});
  for (const double u : {0.0, -0.5, 1.0, std::nan("")})
    EXPECT_THROW(waters_task_set(u, random), AnalysisError);
}

WatersOptions small(std::uint32_t sets) { return {.seed = 3, .sets = sets, .methods = kAll, .threads = 1}; }

TEST(WatersExperiment, ResultsDoNotDependOnTheNumberOfThreads) {
  WatersOptions options = small(20);
  const WatersResult one = run_waters(options);
  options.threads = 5;
  EXPECT_TRUE(run_waters(options) == one);
  EXPECT_GT(one.rows.size(), 100U);
}

TEST(WatersExperiment, ALevelsSetsDoNotDependOnTheOtherLevels) {
  WatersOptions options = small(5);
  WatersResult all = run_waters(options);
  std::erase_if(all.rows, [](const WatersRow& r) { return r.level != 1; });
  options.utilisations = {0.8};
  const WatersResult alone = run_waters(options);
  ASSERT_EQ(all.rows.size(), alone.rows.size());
  for (std::size_t i = 0; i < alone.rows.size(); ++i) EXPECT_EQ(all.rows[i].bound, alone.rows[i].bound);
}

/// Half width beyond which two independent runs of `ours` and `theirs` task sets differ by chance
/// once in a thousand times.
double allowance(const ClusteredEstimate& e, double ours, double theirs) {
  const double standard_error = (e.high - e.low) / 2 / 1.96;
  return 3.3 * standard_error * std::sqrt(1 + ours / theirs);
}

TEST(SectionVIIB, SixtyPercentAgreesWithReferenceRunsOfTheAuthorsCode) {
  const WatersOptions options{.seed = 20, .utilisations = {0.6}, .sets = 1000, .methods = kAll};
  const auto summaries = summarise_waters(options, run_waters(options));
  const WatersSummary& s = summaries.front();
  const auto near = [&](const ClusteredEstimate& e, double reference, double sets) {
    EXPECT_NEAR(e.value, reference, allowance(e, s.schedulable, sets));
  };
  near(s.schedulable_share, 331.0 / 400, 331);
  near(s.mean, 20.38, 331);
  near(s.median, 12.29, 331);
  near(s.p25, 4.31, 331);
  near(s.p75, 29.22, 331);
  EXPECT_NEAR(s.deviation, 21.78, 1.2);
  EXPECT_NEAR(s.p5, 0.55, 0.1);
  EXPECT_NEAR(s.p95, 72.86, 2);
  EXPECT_NEAR(s.max, 85.34, 3);
  EXPECT_NEAR(static_cast<double>(s.chains) / s.sets_with_chains, 8331.0 / 331, 1.5);
  // Of another run, which has the tighter methods as well.
  const double median[] = {13.50, 13.62, 17.83, 50.68}, mean[] = {20.98, 21.05, 23.99, 48.11};
  for (std::size_t m = 0; m < 4; ++m) {
    SCOPED_TRACE(to_string(summaries[m].method));
    near(summaries[m].median, median[m], 117);
    near(summaries[m].mean, mean[m], 117);
    EXPECT_EQ(summaries[m].schedulable, s.schedulable);
    EXPECT_EQ(summaries[m].positive_share.value, 1);
  }
}

/// Three task sets with reductions of 10, 20 | 30 | 40 percent, one of them negative in a second method.
WatersResult handmade() {
  WatersResult result;
  result.sets = {{0, 0, 9, 2, true, true},
                 {0, 1, 9, 1, true, true},
                 {0, 2, 9, 1, true, true},
                 {0, 3, 9, 1, false, false}};
  result.rows = {{0, 0, 0, 2, 100, {90, 110}},
                 {0, 0, 1, 2, 100, {80, 80}},
                 {0, 1, 0, 2, 100, {70, -1}},
                 {0, 2, 0, 2, 100, {60, 60}}};
  return result;
}

TEST(WatersStatistics, EstimatesAndClusteredIntervalsByHand) {
  const WatersOptions options{.utilisations = {0.6}, .sets = 4, .methods = {kAll[0], kAll[1]}};
  const auto summaries = summarise_waters(options, handmade());
  ASSERT_EQ(summaries.size(), 2U);
  const WatersSummary& s = summaries[0];
  EXPECT_EQ(s.schedulable, 3U);
  EXPECT_EQ(s.chains, 4U);
  EXPECT_DOUBLE_EQ(s.schedulable_share.value, 0.75);
  EXPECT_DOUBLE_EQ(s.mean.value, 25);
  EXPECT_DOUBLE_EQ(s.median.value, 25);
  EXPECT_DOUBLE_EQ(s.min, 10);
  EXPECT_DOUBLE_EQ(s.max, 40);
  EXPECT_DOUBLE_EQ(s.deviation, std::sqrt(125));
  // Residuals of the sets: -20, 5, 15; variance (3/2) * 650 / 16.
  EXPECT_NEAR(s.mean.high - s.mean.value, 1.959964 * std::sqrt(1.5 * 650 / 16), 1e-5);
  EXPECT_EQ(summaries[1].chains, 3U) << "a chain without a bound does not count";
  EXPECT_DOUBLE_EQ(summaries[1].min, -10);
  EXPECT_NEAR(summaries[1].positive_share.value, 2.0 / 3, 1e-12);
}

TEST(WatersStatistics, NoChainsAndOneSetAreGuarded) {
  const WatersOptions options{.utilisations = {0.6}, .sets = 1};
  WatersResult result;
  result.sets = {{0, 0, 9, 0, false, false}};
  EXPECT_TRUE(std::isnan(summarise_waters(options, result)[0].median.value));
  result = handmade();
  result.rows.resize(2);
  const WatersSummary one = summarise_waters(options, result)[0];
  EXPECT_DOUBLE_EQ(one.mean.value, 15);
  EXPECT_TRUE(std::isnan(one.mean.low));
  result.rows.resize(1);
  EXPECT_EQ(waters_histograms(options, result, 4)[0].count, (std::vector<std::uint64_t>{1, 0, 0, 0}));
}

TEST(WatersStatistics, HistogramCoversThePanelsOwnRange) {
  const WatersOptions options{.utilisations = {0.6}, .sets = 4};
  const WatersHistogram h = waters_histograms(options, handmade(), 3).front();
  EXPECT_DOUBLE_EQ(h.low, 10);
  EXPECT_DOUBLE_EQ(h.width, 10);
  EXPECT_EQ(h.count, (std::vector<std::uint64_t>{1, 1, 2}));
}

TEST(WatersCsv, OneLineForEachChainAndBin) {
  const WatersOptions options{.utilisations = {0.6}, .sets = 4, .methods = {kAll[0], kAll[1]}};
  std::ostringstream rows, histogram;
  write_waters_csv(rows, options, handmade());
  EXPECT_THAT(rows.str(),
              testing::StartsWith("utilisation,set,chain,length,default_ns,brueggen_davare_ns,"
                                  "brueggen_davare_reduction_percent,davis_davare_ns,davis_davare_reduction_"
                                  "percent\n0.6,0,0,2,100,90,10,110,-10\n"));
  EXPECT_THAT(rows.str(), testing::HasSubstr("0.6,1,0,2,100,70,30,,\n"));
  write_waters_histogram_csv(histogram, waters_histograms(options, handmade(), 3));
  EXPECT_THAT(histogram.str(), testing::StartsWith("utilisation,method,low_percent,high_percent,chains\n"
                                                   "0.6,brueggen_davare,10,20,1\n"));
}

}  // namespace hotpath::waters_test
