// SPDX-License-Identifier: Apache-2.0
#include "live/publishing_effect.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace hotpath {
namespace {

/// Repetitions of one executor with one chain; published repetitions take `slower` times as long.
std::vector<results::ExecutorRuns> runs(std::uint32_t repetitions, double slower) {
  results::ExecutorRuns of_executor{"rm-ro", {}};
  for (std::uint32_t r = 0; r < repetitions; ++r) {
    results::Repetition& repetition = of_executor.repetitions.emplace_back();
    repetition.trace.repetition = r;
    for (int i = 0; i < 50; ++i) {
      ChainRecord record;
      record.sequence = static_cast<std::uint64_t>(i);
      record.hot_path_latency = from_ms((10 + 0.01 * i) * (live::published_by_turns(r) ? slower : 1));
      repetition.trace.chains.push_back(record);
    }
  }
  return {of_executor};
}

results::SummaryOptions one_chain() {
  results::SummaryOptions options;
  options.chains = {"path"};
  return options;
}

TEST(PublishingEffect, EverySecondRepetitionIsPublishedAndDriftFavoursNeitherSide) {
  int sum_of_published = 0, sum_of_others = 0;
  for (std::uint32_t r = 0; r < 8; ++r) (live::published_by_turns(r) ? sum_of_published : sum_of_others) += r;
  EXPECT_EQ(sum_of_published, sum_of_others);
}

TEST(PublishingEffect, IsTheRatioOfTheMediansWithItsInterval) {
  const auto effects = live::publishing_effects(runs(8, 1.03), one_chain());
  ASSERT_EQ(effects.size(), 1U);
  EXPECT_EQ(effects[0].executor, "rm-ro");
  EXPECT_EQ(effects[0].chain, "path");
  EXPECT_EQ(effects[0].samples_with, 200U);
  EXPECT_EQ(effects[0].samples_without, 200U);
  EXPECT_NEAR(effects[0].median_ratio.value, 1.03, 1e-6);
  ASSERT_TRUE(effects[0].median_ratio.interval);
  EXPECT_LE(effects[0].median_ratio.interval->low, 1.03 + 1e-6);
  EXPECT_GE(effects[0].median_ratio.interval->high, 1.03 - 1e-6);
  std::ostringstream text;
  live::write_publishing_effects(text, effects);
  EXPECT_THAT(text.str(), testing::HasSubstr("rm-ro, path: +3.00 % [+3.00, +3.00]"));
  EXPECT_EQ(nlohmann::json(effects)[0]["n_live"], 200);
}

TEST(PublishingEffect, TooFewRepetitionsHaveNoIntervalAndSayWhatToDo) {
  const auto two = live::publishing_effects(runs(2, 1), one_chain());
  EXPECT_FALSE(two[0].median_ratio.interval);
  std::ostringstream text;
  live::write_publishing_effects(text, two);
  EXPECT_THAT(text.str(), testing::HasSubstr("four repetitions"));
  EXPECT_TRUE(nlohmann::json(two)[0]["median_ratio"]["interval"].is_null());

  const auto one = live::publishing_effects(runs(1, 1), one_chain());
  EXPECT_TRUE(std::isnan(one[0].median_ratio.value));
  std::ostringstream nothing;
  live::write_publishing_effects(nothing, one);
  EXPECT_THAT(nothing.str(), testing::HasSubstr("measure longer"));
}

}  // namespace
}  // namespace hotpath
