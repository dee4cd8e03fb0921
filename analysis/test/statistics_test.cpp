// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/statistics.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace hotpath::statistics_test {

using Repetitions = std::vector<std::vector<double>>;

TEST(Quantile, IsThatOfHyndmanAndFansType7) {
  const std::vector<double> one = {7}, two = {10, 20}, four = {1, 2, 3, 4};
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  for (const double p : {0.0, 0.5, 0.999, 1.0}) EXPECT_EQ(quantile(one, p), 7.0);
  EXPECT_EQ(quantile(two, 0.0), 10.0);
  EXPECT_DOUBLE_EQ(quantile(two, 0.25), 12.5);
  EXPECT_DOUBLE_EQ(quantile(two, 0.99), 19.9);
  EXPECT_EQ(quantile(two, 1.0), 20.0);
  EXPECT_DOUBLE_EQ(quantile(four, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(quantile(four, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile(four, 0.9), 3.7);
}

TEST(NearestRank, IsTheFirstSampleThatEnoughDoNotExceed) {
  EXPECT_EQ(nearest_rank(100, 0.99), 98u);
  EXPECT_EQ(nearest_rank(101, 0.99), 99u);
  EXPECT_EQ(nearest_rank(4, 0.5), 1u);
  EXPECT_EQ(nearest_rank(5, 0.5), 2u);
  EXPECT_EQ(nearest_rank(5, 0), 0u);
  EXPECT_EQ(nearest_rank(5, 1), 4u);
}

TEST(Quantiles, OfNoSampleHaveNoValueAndThoseOfOneAreAllTheSame) {
  const Quantiles none = quantiles({}), one = quantiles({3.0});
  EXPECT_EQ(none.n, 0u);
  EXPECT_EQ(one.n, 1u);
  for (const auto q : {&Quantiles::min, &Quantiles::p50, &Quantiles::p90, &Quantiles::p99, &Quantiles::p999,
                       &Quantiles::max, &Quantiles::mean}) {
    EXPECT_TRUE(std::isnan(none.*q));
    EXPECT_EQ(one.*q, 3.0);
  }
}

TEST(Quantiles, OfUnorderedSamples) {
  std::vector<double> samples;
  for (int k = 1000; k >= 0; --k) samples.push_back(k);
  const Quantiles q = quantiles(samples);
  EXPECT_EQ(q.n, 1001u);
  EXPECT_EQ(q.min, 0);
  EXPECT_DOUBLE_EQ(q.p50, 500);
  EXPECT_DOUBLE_EQ(q.p90, 900);
  EXPECT_DOUBLE_EQ(q.p99, 990);
  EXPECT_DOUBLE_EQ(q.p999, 999);
  EXPECT_EQ(q.max, 1000);
  EXPECT_DOUBLE_EQ(q.mean, 500);
}

TEST(RepeatedSamples, ResampledQuantileEqualsThatOfThePoolWrittenOut) {
  std::mt19937_64 random(42);
  for (int round = 0; round < 200; ++round) {
    Repetitions repetitions(1 + random() % 6);
    for (auto& samples : repetitions) {
      samples.resize(1 + random() % 30);
      for (double& s : samples) s = static_cast<double>(random() % 50);  // with ties
    }
    std::vector<std::uint32_t> times(repetitions.size());
    for (auto& t : times) t = static_cast<std::uint32_t>(random() % 4);
    std::vector<double> pool;
    for (std::size_t r = 0; r < repetitions.size(); ++r) {
      for (std::uint32_t t = 0; t < times[r]; ++t) {
        pool.insert(pool.end(), repetitions[r].begin(), repetitions[r].end());
      }
    }
    std::sort(pool.begin(), pool.end());
    const RepeatedSamples sut(repetitions);
    for (const double p : {0.0, 0.1, 0.5, 0.99, 0.999, 1.0}) {
      const double expected = quantile(pool, p);
      if (pool.empty()) {
        EXPECT_TRUE(std::isnan(sut.resampled_quantile(times, p)));
      } else {
        EXPECT_DOUBLE_EQ(sut.resampled_quantile(times, p), expected);
      }
    }
  }
}

TEST(RepeatedSamples, LeaveOutRepetitionsWithoutSamples) {
  const RepeatedSamples sut(Repetitions{{2.0}, {}, {1.0}});
  EXPECT_EQ(sut.repetitions(), 2u);
  EXPECT_THAT(sut.pooled(), testing::ElementsAre(1.0, 2.0));
}

// Two repetitions of one sample each: the pools {1,1}, {1,3}, {3,1}, {3,3} are equally likely, so
// the median is 1, 2 or 3 with probabilities 1/4, 1/2, 1/4.
TEST(Bootstrap, ResamplesWholeRepetitionsWithReplacement) {
  const RepeatedSamples samples(Repetitions{{1.0}, {3.0}});
  const std::array median = {0.5};
  const Estimate wide = estimate_quantiles(samples, median, {.confidence = 0.95})[0];
  EXPECT_EQ(wide.value, 2.0);
  ASSERT_TRUE(wide.interval);
  EXPECT_EQ(wide.interval->low, 1.0);
  EXPECT_EQ(wide.interval->high, 3.0);
  const Estimate narrow = estimate_quantiles(samples, median, {.confidence = 0.4})[0];
  ASSERT_TRUE(narrow.interval);
  EXPECT_EQ(narrow.interval->low, 2.0);
  EXPECT_EQ(narrow.interval->high, 2.0);
}

TEST(Bootstrap, FewerThanTwoRepetitionsGiveNoInterval) {
  const std::array median = {0.5};
  EXPECT_FALSE(estimate_quantiles(RepeatedSamples(Repetitions{{1.0, 2.0, 3.0}}), median)[0].interval);
  EXPECT_FALSE(estimate_quantiles(RepeatedSamples(Repetitions{{1.0, 2.0}, {}}), median)[0].interval);
  EXPECT_FALSE(estimate_quantiles(RepeatedSamples(Repetitions{}), median)[0].interval);
  EXPECT_TRUE(std::isnan(estimate_quantiles(RepeatedSamples(Repetitions{}), median)[0].value));
  EXPECT_FALSE(
      ratio_of_quantiles(RepeatedSamples(Repetitions{{1.0}}), RepeatedSamples(Repetitions{{1.0}, {2.0}}), 0.5)
          .interval);
}

TEST(Bootstrap, EqualRepetitionsGiveAnIntervalWithoutWidth) {
  const std::vector<double> same = {1.0, 2.0, 4.0, 8.0, 16.0};
  const std::array extremes = {0.0, 1.0};
  for (const Estimate& e : estimate_quantiles(RepeatedSamples({same, same, same}), extremes)) {
    ASSERT_TRUE(e.interval);
    EXPECT_EQ(e.interval->low, e.value);
    EXPECT_EQ(e.interval->high, e.value);
  }
}

TEST(Bootstrap, SeedDecidesTheInterval) {
  std::mt19937_64 random(3);
  Repetitions repetitions(7, std::vector<double>(20));
  for (auto& samples : repetitions) {
    for (double& s : samples) s = static_cast<double>(random() % 100000);
  }
  const RepeatedSamples samples(repetitions);
  const std::array median = {0.5};
  const auto low = [&](std::uint64_t seed) {
    return estimate_quantiles(samples, median, {.resamples = 50, .seed = seed})[0].interval->low;
  };
  EXPECT_EQ(low(1), low(1));
  EXPECT_NE(low(1), low(2));
}

// Samples of one repetition share that repetition's shift; an interval from resampled single
// samples would be about seven times too narrow and would rarely contain the true median.
TEST(Bootstrap, IntervalContainsTheTrueMedianAtAboutItsConfidence) {
  std::mt19937_64 random(11);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  const std::array median = {0.5};
  constexpr int kExperiments = 200;
  int holds = 0;
  for (int experiment = 0; experiment < kExperiments; ++experiment) {
    Repetitions repetitions(12, std::vector<double>(50));
    for (auto& samples : repetitions) {
      const double shift = uniform();
      for (double& s : samples) s = shift + 0.1 * uniform();
    }
    const auto interval =
        estimate_quantiles(RepeatedSamples(repetitions), median, {.resamples = 400})[0].interval;
    if (interval->low <= 0 && 0 <= interval->high) ++holds;
  }
  EXPECT_GE(holds, kExperiments * 85 / 100);
  EXPECT_LT(holds, kExperiments);
}

TEST(Comparison, ValueComparesThePooledQuantiles) {
  const RepeatedSamples a(Repetitions{{30.0, 40.0}, {50.0}}), b(Repetitions{{10.0}, {20.0, 30.0}});
  EXPECT_DOUBLE_EQ(ratio_of_quantiles(a, b, 0.5).value, 2.0);
  EXPECT_DOUBLE_EQ(difference_of_quantiles(a, b, 0.5).value, 20.0);
  EXPECT_DOUBLE_EQ(ratio_of_quantiles(a, b, 1.0).value, 50.0 / 30.0);
}

// Resampled together, both sides would always be equal and the interval would have no width.
TEST(Comparison, ResamplesBothSidesIndependently) {
  const RepeatedSamples samples(Repetitions{{1.0}, {3.0}});
  const Estimate ratio = ratio_of_quantiles(samples, samples, 0.5);
  ASSERT_TRUE(ratio.interval);
  EXPECT_DOUBLE_EQ(ratio.interval->low, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(ratio.interval->high, 3.0);
  const Estimate difference = difference_of_quantiles(samples, samples, 0.5);
  EXPECT_DOUBLE_EQ(difference.interval->low, -2.0);
  EXPECT_DOUBLE_EQ(difference.interval->high, 2.0);
  const RepeatedSamples one(Repetitions{{2.0}});
  EXPECT_DOUBLE_EQ(cliffs_delta(samples, one).interval->high, 1.0);  // of one side alone
  EXPECT_DOUBLE_EQ(cliffs_delta(one, samples).interval.value().low, -1.0);
}

TEST(RankTest, AsScipyHasIt) {
  // scipy.stats.mannwhitneyu(a, b)
  const RepeatedSamples a(Repetitions{{1, 2, 2, 3, 5, 8}, {8, 9, 11, 12.5}});
  const RepeatedSamples b(Repetitions{{2, 4, 6, 8, 8, 10, 13, 14, 15, 16, 17}});
  EXPECT_NEAR(rank_test(a, b), 0.07125105188801, 1e-12);
  EXPECT_NEAR(rank_test(b, a), 0.07125105188801, 1e-12);
}

TEST(RankTest, OfEqualSamplesAndOfNone) {
  const RepeatedSamples equal(Repetitions{{3, 3, 3}}), none(Repetitions{});
  EXPECT_EQ(rank_test(equal, equal), 1);
  EXPECT_TRUE(std::isnan(rank_test(equal, none)));
}

TEST(FitLine, AsNumpyHasIt) {
  // numpy.polyfit(x, y, 1, w=numpy.sqrt(weights))
  const std::vector<double> x = {1, 2, 3, 7}, y = {130, 190, 270, 600}, weights = {4, 9, 1, 2};
  const Line line = fit_line(x, y, weights);
  EXPECT_NEAR(line.slope, 79.54271961492, 1e-9);
  EXPECT_NEAR(line.intercept, 37.36462093863, 1e-9);
}

TEST(FitLine, OfOnePlacePassesThroughTheOrigin) {
  const std::vector<double> x = {4, 4}, y = {100, 140}, weights = {1, 3};
  const Line line = fit_line(x, y, weights);
  EXPECT_DOUBLE_EQ(line.slope, 32.5);
  EXPECT_DOUBLE_EQ(line.intercept, 0);
}

}  // namespace hotpath::statistics_test
