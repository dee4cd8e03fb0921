// SPDX-License-Identifier: Apache-2.0
// The gate on made-up repetitions: alarms, power, errors and reports; differences of single samples and of
// the counters of benchmarks.
#include "comparison/comparison.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "comparison/report.hpp"
#include "graph_fixture.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::comparison::comparison_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Names = std::multiset<std::string>;

constexpr const char* kExecutors[] = {"default", "static", "events-ro", "rm-ro"};
constexpr double kNoise = 0.02;  // standard deviation of a repetition's median
constexpr std::int64_t kRepetitions = 8;

/// What one live side differs in.
struct Live {
  const char* slower = "";
  double by = 1.1;
  std::int64_t repetitions = kRepetitions;
  double losses = 3;  // mean of a repetition
  double trend = 0;   // the last repetition is exp(trend) times as slow as the first, for a tired machine
};

Side live(std::mt19937& random, const Live& of = {}) {
  Side side;
  std::normal_distribution<double> noise(0, kNoise);
  std::uniform_real_distribution<double> sample(16, 28);
  std::poisson_distribution<int> losses(of.losses);
  for (const char* const executor : kExecutors) {
    Samples& samples = side.samples[{Latency::hot_path, "autoware", Source::live, "80 %", executor, ""}];
    Series& lost =
        side.counts[{Measure::losses, {std::nullopt, "autoware", Source::live, "80 %", executor, ""}}];
    for (std::int64_t r = 0; r < of.repetitions; ++r) {
      const double factor = (executor == std::string(of.slower) ? of.by : 1) *
                            std::exp(noise(random) + of.trend * static_cast<double>(r) / kRepetitions);
      for (int k = 0; k < 100; ++k) samples.of(r).push_back(factor * sample(random));
      lost[r] = losses(random);
    }
  }
  return side;
}

/// Simulations with seeds from `first`, of these medians.
Side simulated(const std::vector<double>& medians, std::int64_t first = 1) {
  Side side;
  Samples& samples = side.samples[{Latency::hot_path, "autoware", Source::simulated, "80 %", "rm-ro", ""}];
  for (const double median : medians) samples.of(first++) = {median, median, 2 * median};
  return side;
}

Names worse(const std::vector<Judgement>& judgements) {
  Names names;
  for (const Judgement& j : judgements) {
    if (j.verdict() == Verdict::worse) names.insert(j.what);
  }
  return names;
}

/// How many of 40 pairs of builds, the second of which differs, satisfy `is`.
int pairs_with(const Live& second, const auto& is, unsigned first_seed = 0) {
  int found = 0;
  for (unsigned seed = first_seed; seed < first_seed + 40; ++seed) {
    std::mt19937 random(seed);
    const Side old = live(random);
    found += is(judge(old, live(random, second), false)) ? 1 : 0;
  }
  return found;
}

bool finds_static(const std::vector<Judgement>& judgements) {
  const Names names = worse(judgements);
  return !names.empty() && names.count("hot path autoware live 80 % static") == names.size();
}

TEST(Gate, FiresForASlowerExecutorAlone) {
  EXPECT_LE(pairs_with({}, [](const auto& judged) { return !worse(judged).empty(); }), 1);
  EXPECT_GE(pairs_with({"static"}, finds_static), 38);
  EXPECT_LE(pairs_with({"static", 0.5}, [](const auto& judged) { return !worse(judged).empty(); }), 1);
}

TEST(Gate, FiresForLosses) {
  std::mt19937 random(1);
  const Side old = live(random);
  for (const Judgement& j : judge(old, live(random, {.losses = 23}), false))
    EXPECT_EQ(j.verdict() == Verdict::worse, j.measure == Measure::losses) << j.what;
}

TEST(Gate, RepetitionsByTurnsArePairs) {
  std::mt19937 random(1);
  const Side old = live(random, {.trend = 1}), now = live(random, {.slower = "static", .trend = 1});
  EXPECT_TRUE(finds_static(judge(old, now, true)));
  EXPECT_TRUE(worse(judge(old, now, false)).empty());
}

TEST(Gate, RefusesTooFewRepetitions) {
  std::mt19937 random(1);
  const Side old = live(random), few = live(random, {.repetitions = 2});
  EXPECT_THAT([&] { static_cast<void>(judge(old, few, false)); },
              ThrowsMessage<program::UsageError>(
                  HasSubstr("needs 3 repetitions on each side, one side has 2; measure")));
  EXPECT_THAT([&] { static_cast<void>(judge(simulated({10}), simulated({10}, 2), false)); },
              ThrowsMessage<program::UsageError>(
                  testing::ContainsRegex("of other seeds on each side, one side has 1; .* same --seed")));
}

TEST(Gate, HasTheStatedPower) {
  std::mt19937 random(1);
  Side old = live(random), now = live(random);
  const std::vector<Judgement> judged = judge(old, now, false);
  const Key timer{Latency::response, "T", Source::live, "80 %", "static", ""};
  for (Side* const side : {&old, &now}) side->counts[{Measure::jobs, timer}] = {{0, 5}, {1, 5}, {2, 5}};
  EXPECT_EQ(judge(old, now, false).front().detectable, judged.front().detectable) << "jobs are no test";
  std::vector<double> told;
  for (const Judgement& j : judged) {
    if (!j.counted()) told.push_back(j.detectable_percent());
  }
  std::ranges::sort(told);
  const double growth = quantile(told, 0.5);
  EXPECT_THAT(power_of(judged), HasSubstr(program::text("a growth of %.1f %% would be found", growth)));
  EXPECT_GT(pairs_with({"static", 1 + growth / 100}, finds_static, 100), 30);
}

TEST(Gate, JudgesSimulationsPairByPair) {
  const std::vector<double> three = {10, 17, 12}, five = {10, 17, 12, 30, 22},
                            grown = {10.5, 17.85, 12.6, 31.5, 23.1}, equal(5, 10);
  struct Case {
    std::vector<double> old, now;
    std::int64_t first;
    Verdict verdict;
  };
  for (const Case& c : std::vector<Case>{{{10}, {10.001}, 1, Verdict::worse},
                                         {{10}, {9.999}, 1, Verdict::better},
                                         {three, three, 1, Verdict::same},
                                         {{0, 10}, {0, 10}, 1, Verdict::same},
                                         {five, grown, 1, Verdict::worse},
                                         {five, grown, 11, Verdict::same},
                                         {five, {grown.rbegin(), grown.rend()}, 1, Verdict::same},
                                         {equal, {10.5, 10.5, 9, 10.5, 10.5}, 1, Verdict::same},
                                         {grown, five, 1, Verdict::better},
                                         {three, {17.1}, 2, Verdict::worse}}) {
    const std::vector<Judgement> judged = judge(simulated(c.old), simulated(c.now, c.first), false);
    EXPECT_EQ(judged.size(), 3);
    for (const Judgement& j : judged) EXPECT_EQ(j.verdict(), c.verdict) << j.test.after;
  }
}

const Key kChain{Latency::hot_path, "x", Source::simulated, "80 %", "rm-ro", ""};
const Key kTimer{Latency::response, "T", Source::simulated, "80 %", "rm-ro", ""};
const Key kOther{Latency::hot_path, "x", Source::simulated, "80 %", "other", ""};

/// A side that has only these outputs and jobs, in three repetitions.
Side counted(const std::map<Key, std::vector<double>>& outputs) {
  Side side;
  for (const auto& [key, counts] : outputs) {
    for (std::size_t r = 0; r < counts.size(); ++r)
      side.counts[{key == kTimer ? Measure::jobs : Measure::outputs, key}][static_cast<std::int64_t>(r)] =
          counts[r];
  }
  return side;
}

std::multiset<Verdict> verdicts(const Side& old, const Side& now) {
  std::multiset<Verdict> found;
  for (const Judgement& j : judge(old, now, false)) found.insert(j.verdict());
  return found;
}

TEST(Gate, MissesWhatOneSideAloneHas) {
  const std::vector<double> all(3, 50), some(3, 5);
  const Side whole = counted({{kChain, all}, {kTimer, all}, {kOther, some}});
  EXPECT_THAT(verdicts(whole, whole), ElementsAre(Verdict::same, Verdict::same));
  const std::pair<const char*, Side> lacks[] = {
      {"outputs of one repetition", counted({{kChain, {50, 0, 50}}, {kTimer, all}, {kOther, some}})},
      {"most outputs of one repetition", counted({{kChain, {50, 20, 50}}, {kTimer, all}, {kOther, some}})},
      {"jobs of a timer", counted({{kChain, all}, {kTimer, {50, 50, 0}}, {kOther, some}})},
      {"the chain", counted({{kTimer, all}, {kOther, some}})},
      {"the timer", counted({{kChain, all}, {kOther, some}})},
      {"an executor", counted({{kChain, all}, {kTimer, all}})},
      {"a repetition", counted({{kChain, {50, 50}}, {kTimer, {50, 50}}, {kOther, {5, 5}}})}};
  for (const auto& [what, side] : lacks) {
    EXPECT_TRUE(verdicts(whole, side).contains(Verdict::worse)) << what;
    const std::multiset<Verdict> gained = verdicts(side, whole);
    EXPECT_FALSE(gained.contains(Verdict::worse)) << what;
    EXPECT_TRUE(gained.contains(Verdict::better) || gained.contains(Verdict::not_comparable)) << what;
  }
}

TEST(Gate, OneOutputThatEndsAfterTheRunIsNoLoss) {
  const Side old = counted({{kChain, {50, 50, 50}}});
  EXPECT_THAT(verdicts(old, counted({{kChain, {50, 49, 50}}})), ElementsAre(Verdict::same));
  EXPECT_THAT(verdicts(old, counted({{kChain, {45, 45, 45}}})), ElementsAre(Verdict::worse));
}

TEST(Gate, Reports) {
  std::mt19937 random(4);
  Side old = live(random), now = live(random, {.slower = "rm-ro", .by = 1.5});
  old.counts.clear();
  const std::vector<Judgement> judged = judge(old, now, false);
  const char* const name = "hot path autoware live 80 % rm-ro";
  EXPECT_THAT(worse(judged), ElementsAre(name, name, name));
  const std::string junit = junit_of(judged);
  EXPECT_THAT(junit, HasSubstr("<testsuite name=\"hotpath gate\" tests=\"12\" failures=\"3\">"));
  EXPECT_THAT(
      junit,
      HasSubstr("<testcase classname=\"hot path autoware live 80 % rm-ro\" name=\"p50\"><failure message="));
  EXPECT_THAT(junit, HasSubstr("<testcase classname=\"hot path autoware live 80 % static\" name=\"p50\" />"));
  const std::string markdown = markdown_of(judged, {"old", "new"});
  EXPECT_THAT(markdown,
              testing::StartsWith(
                  "### Overall: worse (3 worse, 9 no difference beyond noise; of 12 measures; independent "
                  "repetitions; at most"));
  EXPECT_THAT(markdown, testing::ContainsRegex("---: \\|\n\\| hot path autoware live 80 % rm-ro \\| mean .*"
                                               "\\| \\+[45][0-9]\\.[0-9] % \\| \\[\\+.* \\| worse \\|\n"));
}

TEST(Differences, AreBeyondNoiseOrNot) {
  Samples one, other, exact;
  for (int k = 0; k < 109; ++k) {
    one.of(3).push_back(10 + k % 7);
    other.of(3).push_back(20 + k % 7);
    exact.of(3).push_back(10 + k % 7);
  }
  exact.deterministic = true;
  Samples longer = exact, few;
  longer.of(3).push_back(50);
  few.of(0) = {10};
  const auto verdict = [](const Samples& a, const Samples& b) {
    return verdict_of(a, b, difference_of_quantiles(b.resampled(), a.resampled(), 1.0));
  };
  EXPECT_EQ(one.resampled().repetitions(), 20U);
  EXPECT_EQ(one.resampled().pooled().size(), 109U);
  EXPECT_EQ(exact.resampled().repetitions(), 1U);
  EXPECT_EQ(verdict(one, other), Verdict::worse);
  EXPECT_EQ(verdict(other, one), Verdict::better);
  EXPECT_EQ(verdict(one, one), Verdict::same);
  EXPECT_EQ(verdict(exact, exact), Verdict::same);
  EXPECT_EQ(verdict(exact, longer), Verdict::worse);
  EXPECT_EQ(verdict(few, few), Verdict::not_comparable);
}

class Counters : public testing::Test {
 protected:
  /// A result of `hotpath bench` with these values of each counter.
  Options stored(const char* name, const std::map<std::string, std::vector<double>>& counters) {
    nlohmann::json rows = nlohmann::json::array();
    for (std::size_t r = 0; r < counters.begin()->second.size(); ++r) {
      rows.push_back({{"name", "a/x:1"}, {"real_time", 5}, {"time_unit", "ns"}, {"threads", 1}});
      for (const auto& [counter, values] : counters) rows.back()[counter] = values[r];
    }
    std::filesystem::create_directories(base_ / name);
    std::ofstream(base_ / name / "bench.json")
        << nlohmann::json{{"context", {{"machine", nlohmann::json::object()}}}, {"benchmarks", rows}};
    return {base_ / "old", base_ / "new"};
  }
  static std::string compared(const Options& options) {
    testing::internal::CaptureStdout();
    EXPECT_FALSE(compare(options));
    return testing::internal::GetCapturedStdout();
  }

  const Folder folder_;
  const std::filesystem::path base_ = folder_.path();
};

TEST_F(Counters, ThatChangedAreBeyondNoise) {
  stored("old", {{"decide_ns", {100, 101, 99, 100, 102}}, {"delta_ns", {100, 80, 120, 95, 105}}});
  const std::string text =
      compared(stored("new", {{"decide_ns", {50, 51, 49, 50, 52}}, {"delta_ns", {103, 84, 118, 99, 101}}}));
  EXPECT_THAT(text,
              testing::ContainsRegex(
                  "a/x:1 decide_ns +100 +50\\.0 +-50 +\\[-5[0-9.]+, -4[0-9.]+\\] +differs beyond noise"));
  EXPECT_THAT(text, testing::ContainsRegex("a/x:1 delta_ns .* no difference beyond noise"));
  EXPECT_THAT(text, HasSubstr("\n1 of 2 counters differ beyond noise.\nTimes: "));
}

TEST_F(Counters, NeedRepetitionsAndACommonName) {
  stored("old", {{"x_ns", {5}}});
  EXPECT_THAT(compared(stored("new", {{"x_ns", {5}}})), HasSubstr("not comparable"));
  const Options other = stored("new", {{"y_ns", {1}}});
  EXPECT_THAT([&] { return compare(other); },
              ThrowsMessage<program::UsageError>(HasSubstr("no counter in common")));
}

}  // namespace hotpath::comparison::comparison_test
