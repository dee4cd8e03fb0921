// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/growth_test.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace hotpath::growth_test {

using testing::DoubleNear;
using testing::Pointwise;
using Values = std::vector<double>;

GrowthTest ratios(const Values& before, const Values& after, Pairing pairing) {
  return test_growth(before, after, pairing, Scale::ratio);
}

GrowthTest differences(const Values& before, const Values& after, Pairing pairing) {
  return test_growth(before, after, pairing, Scale::difference);
}

TEST(GrowthTest, WelchEqualsScipy) {
  // scipy.stats.ttest_ind(after, before, equal_var=False, alternative="greater")
  const GrowthTest t =
      differences({20.4, 24.2, 15.4, 21.4, 20.2}, {19.4, 27.2, 27.3, 25.9}, Pairing::independent);
  EXPECT_NEAR(t.growth, 4.63, 1e-12);
  EXPECT_NEAR(t.degrees_of_freedom, 5.959272719, 1e-9);
  EXPECT_NEAR(t.p_value, 0.0486114842, 1e-9);
  EXPECT_NEAR(t.interval.low, -1.142319123, 1e-6);
  EXPECT_NEAR(t.interval.high, 10.40231912, 1e-6);
}

TEST(GrowthTest, PairsEqualScipy) {
  // scipy.stats.ttest_rel(after, before, alternative="greater")
  const Values before = {100, 200, 300, 400}, after = {106, 202, 311, 409};
  EXPECT_NEAR(differences(before, after, Pairing::paired).p_value, 0.01870577931, 1e-9);
  EXPECT_GT(differences(before, after, Pairing::independent).p_value, 0.4);
}

TEST(GrowthTest, OfRatiosIsAFactorBetweenGeometricMeans) {
  const GrowthTest t = ratios({10, 40}, {20, 80}, Pairing::paired);
  EXPECT_NEAR(t.before, 20, 1e-9);
  EXPECT_NEAR(t.after, 40, 1e-9);
  EXPECT_NEAR(t.growth, 2, 1e-9);
}

TEST(GrowthTest, ExactPairsThatAgreeNeedNoTest) {
  const Values before = {10, 20, 30, 40, 50};
  for (const auto& [after, p] : std::vector<std::pair<Values, double>>{
           {before, 1}, {{10.1, 20.001, 33, 44, 58}, 0}, {{9, 20, 30, 40, 50}, 1}}) {
    const GrowthTest t = ratios(before, after, Pairing::exact);
    EXPECT_TRUE(t.exact);
    EXPECT_EQ(t.p_value, p);
    EXPECT_TRUE(std::isnan(t.interval.low));
    EXPECT_EQ(detectable_growth(t, Scale::ratio, 0.01, 0.9), 1);
  }
  EXPECT_EQ(ratios({10}, {10.001}, Pairing::exact).p_value, 0);
  EXPECT_EQ(ratios({10}, {10}, Pairing::exact).p_value, 1);
}

TEST(GrowthTest, ExactPairsThatDisagreeAreTested) {
  const Values before = {10, 10, 10, 10, 10}, mixed = {10.5, 10.5, 9, 10.5, 10.5};
  const GrowthTest t = ratios(before, mixed, Pairing::exact);
  EXPECT_FALSE(t.exact);
  EXPECT_GT(t.p_value, 0.2);
  EXPECT_LT(t.p_value, 0.4);
  EXPECT_LT(ratios(before, {15, 15.5, 9.99, 16, 15.2}, Pairing::exact).p_value, 0.02);
}

TEST(GrowthTest, ValuesThatDoNotVaryAreDecidedByTheirDifference) {
  for (const Pairing pairing : {Pairing::independent, Pairing::paired, Pairing::exact}) {
    EXPECT_EQ(ratios({2, 2, 2}, {3, 3, 3}, pairing).p_value, 0);
    EXPECT_EQ(ratios({0.1 + 0.2, 0.3, 0.3}, {0.3, 0.3, 0.3}, pairing).p_value, 1) << "rounding";
  }
}

TEST(GrowthTest, FewEqualCountsDoNotShowThatCountsNeverVary) {
  const Values before(5, 364), after(5, 365), many(20, 365);
  for (const Pairing pairing : {Pairing::independent, Pairing::paired}) {
    EXPECT_GT(differences(before, after, pairing).p_value, 1e-4);
    EXPECT_LT(differences(before, Values(5, 384), pairing).p_value, 1e-5);
    EXPECT_LT(differences(Values(20, 364), many, pairing).p_value, 1e-7);
    EXPECT_EQ(differences(before, before, pairing).p_value, 0.5);
  }
  // Student's t of sqrt(30): the difference of two counts varies by twice 1/12.
  EXPECT_NEAR(differences(before, after, Pairing::paired).p_value, 0.00270423943, 1e-9);
  EXPECT_EQ(differences(before, after, Pairing::exact).p_value, 0);
  EXPECT_EQ(differences(before, before, Pairing::exact).p_value, 1);
}

/// Share of 4000 comparisons that are alarms at 1 %, with five normal repetitions per side.
double alarms(Pairing pairing, double growth, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  int fired = 0;
  for (int round = 0; round < 4000; ++round) {
    Values before, after;
    for (int r = 0; r < 5; ++r) {
      before.push_back(std::exp(noise * normal(random)));
      after.push_back(std::exp(growth + noise * normal(random)));
    }
    fired += ratios(before, after, pairing).p_value < 0.01;
  }
  return fired / 4000.0;
}

TEST(GrowthTest, FalseAlarmsAreAsRareAsTheirRate) {
  for (const Pairing pairing : {Pairing::independent, Pairing::paired, Pairing::exact}) {
    EXPECT_LT(alarms(pairing, 0, 0.02, 1), pairing == Pairing::exact ? 0.045 : 0.015);
  }
}

TEST(GrowthTest, DetectableGrowthIsDetectedAtTheGivenRate) {
  const double noise = 0.02;
  for (const auto& [pairing, degrees] : {std::pair{Pairing::independent, 8}, std::pair{Pairing::paired, 4}}) {
    GrowthTest t;
    t.standard_error = noise * std::sqrt(2.0 / 5);
    t.degrees_of_freedom = degrees;
    const double growth = std::log(detectable_growth(t, Scale::ratio, 0.01, 0.9));
    EXPECT_NEAR(alarms(pairing, growth, noise, 3), 0.9, 0.04);
  }
}

TEST(Holm, HisExample) {
  const Values p = {0.01, 0.04, 0.03, 0.005};
  EXPECT_THAT(holm(p), Pointwise(DoubleNear(1e-12), Values{0.03, 0.06, 0.06, 0.02}));
  EXPECT_TRUE(holm({}).empty());
}

}  // namespace hotpath::growth_test
