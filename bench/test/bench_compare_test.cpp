// SPDX-License-Identifier: Apache-2.0
// Figures out of Google Benchmark's JSON, and which of them differ beyond noise.
#include "microbench/bench_values.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace hotpath {
namespace {

using nlohmann::json;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

json row(const std::string& name, double time, const std::string& unit) {
  return {{"name", name},          {"run_name", name}, {"run_type", "iteration"}, {"iterations", 1},
          {"real_time", time},     {"cpu_time", 1.0},  {"time_unit", unit},       {"family_index", 0},
          {"repetition_index", 0}, {"threads", 1}};
}

BenchValues parsed(std::vector<json> rows) {
  BenchValues bench;
  add_google_benchmark_output(bench, {{"context", json::object()}, {"benchmarks", rows}});
  return bench;
}

BenchValues values_with(std::vector<double> values) {
  BenchValues bench;
  bench.values[{"decide", "time_ns"}] = std::move(values);
  return bench;
}

ValueComparison only_value(const BenchValues& before, const BenchValues& after) {
  const auto comparisons = compare_values(before, after);
  EXPECT_EQ(comparisons.size(), 1U);
  return comparisons.at(0);
}

TEST(BenchValues, TimesAreNanosecondsUnderTheNameOfWhatWasMeasured) {
  const BenchValues f = parsed({row("a/tasks:10/iterations:1/manual_time", 2, "us"),
                                row("b/min_time:0.010", 3, "ns"), row("c", 1, "ms")});
  EXPECT_THAT(f.values.at({"a/tasks:10", "time_ns"}), ElementsAre(2000));
  EXPECT_THAT(f.values.at({"b", "time_ns"}), ElementsAre(3));
  EXPECT_THAT(f.values.at({"c", "time_ns"}), ElementsAre(1e6));
}

TEST(BenchValues, EveryCounterIsAMetricAndBookkeepingIsNone) {
  json counted = row("a", 2, "ns");
  counted["delta_p50_ns"] = 12.5;
  const BenchValues f = parsed({counted});
  EXPECT_EQ(f.values.size(), 2U);
  EXPECT_THAT(f.values.at({"a", "delta_p50_ns"}), ElementsAre(12.5));
}

TEST(BenchValues, RepetitionsComeTogether) {
  BenchValues f;
  for (const double time : {3.0, 1.0, 2.0}) {
    add_google_benchmark_output(f, {{"benchmarks", {row("a", time, "ns")}}});
  }
  EXPECT_THAT(f.values.at({"a", "time_ns"}), ElementsAre(3, 1, 2));
}

TEST(BenchValues, AFailedBenchmarkIsAnErrorAndNoFigure) {
  json failed = row("a", 0, "ns");
  failed["error_occurred"] = true;
  failed["error_message"] = "no result";
  const BenchValues f = parsed({failed});
  EXPECT_TRUE(f.values.empty());
  EXPECT_THAT(f.errors, ElementsAre("a: no result"));
}

TEST(BenchValues, KeepsTheComplexityFit) {
  json fit = {{"name", "drain/manual_time_BigO"},
              {"run_name", "drain/manual_time"},
              {"run_type", "aggregate"},
              {"aggregate_name", "BigO"},
              {"real_coefficient", 0.5},
              {"big_o", "NlgN"},
              {"time_unit", "us"}};
  json rms = {{"name", "drain/manual_time_RMS"},
              {"run_name", "drain/manual_time"},
              {"run_type", "aggregate"},
              {"aggregate_name", "RMS"},
              {"rms", 0.07}};
  const BenchValues f = parsed({fit, rms});
  ASSERT_EQ(f.complexities.size(), 1U);
  EXPECT_EQ(f.complexities[0].benchmark, "drain");
  EXPECT_EQ(f.complexities[0].order, "NlgN");
  EXPECT_EQ(f.complexities[0].coefficient_ns, 500);
  EXPECT_THAT(f.complexities[0].rms_percent, DoubleNear(7, 1e-9));
}

TEST(BenchValues, SurviveTheirFile) {
  BenchValues f = values_with({1, 2.5});
  f.complexities = {{"drain", "N", 3, 4}};
  f.errors = {"x: broken"};
  const BenchValues read = json(f).get<BenchValues>();
  EXPECT_EQ(read.values, f.values);
  EXPECT_EQ(read.errors, f.errors);
  EXPECT_EQ(json(read), json(f));
}

TEST(BenchValues, RefuseOtherFiles) {
  BenchValues f;
  EXPECT_THROW(add_google_benchmark_output(f, json::object()), json::exception);
  EXPECT_THROW((json{{"figures", 3}}.get<BenchValues>()), json::exception);
}

TEST(BenchCompare, ALargeShiftIsBeyondNoiseInItsDirection) {
  const BenchValues slow = values_with({100, 101, 99, 100, 102}), fast = values_with({50, 51, 49, 50, 52});
  const ValueComparison faster = only_value(slow, fast);
  EXPECT_EQ(faster.verdict, Verdict::smaller);
  EXPECT_EQ(faster.before, 100);
  EXPECT_EQ(faster.after, 50);
  EXPECT_DOUBLE_EQ(faster.ratio.value, 0.5);
  EXPECT_LE(faster.ratio.interval->low, 0.5);
  EXPECT_GE(faster.ratio.interval->high, 0.5);
  EXPECT_EQ(only_value(fast, slow).verdict, Verdict::larger);
}

TEST(BenchCompare, AShiftSmallerThanTheSpreadIsNoise) {
  const ValueComparison c =
      only_value(values_with({100, 80, 120, 95, 105}), values_with({103, 84, 118, 99, 101}));
  EXPECT_EQ(c.verdict, Verdict::within_noise);
  EXPECT_LT(c.ratio.interval->low, 1);
  EXPECT_GT(c.ratio.interval->high, 1);
}

TEST(BenchCompare, TheSameFiguresDoNotDiffer) {
  const BenchValues f = values_with({100, 80, 120});
  EXPECT_EQ(only_value(f, f).verdict, Verdict::within_noise);
  EXPECT_EQ(only_value(values_with({7, 7, 7}), values_with({7, 7, 7})).verdict, Verdict::within_noise);
}

TEST(BenchCompare, TooFewRepetitionsAndValuesWithoutARatioAreNotComparable) {
  EXPECT_EQ(only_value(values_with({1, 1}), values_with({9, 9, 9})).verdict, Verdict::not_comparable);
  EXPECT_EQ(only_value(values_with({0, 0, 0}), values_with({9, 9, 9})).verdict, Verdict::not_comparable);
}

TEST(BenchCompare, LeavesOutWhatOnlyOneSideHas) {
  BenchValues more = values_with({1, 2, 3});
  more.values[{"new", "time_ns"}] = {1, 2, 3};
  EXPECT_EQ(compare_values(values_with({1, 2, 3}), more).size(), 1U);
}

TEST(BenchCompare, TheSameSeedGivesTheSameIntervals) {
  const BenchValues a = values_with({100, 80, 120, 95, 105}), b = values_with({103, 84, 118, 99, 101});
  const auto first = compare_values(a, b, 7), second = compare_values(a, b, 7);
  EXPECT_EQ(first[0].ratio.interval->low, second[0].ratio.interval->low);
  EXPECT_EQ(first[0].ratio.interval->high, second[0].ratio.interval->high);
}

TEST(BenchCompare, WritesWhatChangedFirstAndCountsIt) {
  BenchValues before, after;
  before.values[{"a", "time_ns"}] = {100, 101, 102};
  after.values[{"a", "time_ns"}] = {100, 101, 102};
  before.values[{"b", "time_ns"}] = {100, 101, 102};
  after.values[{"b", "time_ns"}] = {200, 201, 202};
  std::ostringstream text;
  write_comparison(text, compare_values(before, after));
  EXPECT_LT(text.str().find("b time_ns"), text.str().find("a time_ns"));
  EXPECT_THAT(text.str(), HasSubstr("1 of 2 values differ beyond noise."));
  EXPECT_THAT(text.str(), HasSubstr("larger"));
}

}  // namespace
}  // namespace hotpath
