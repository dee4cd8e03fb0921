// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/exact.hpp"

#include <gtest/gtest.h>

#include "hotpath/analysis/analysis_error.hpp"

namespace hotpath::exact::exact_test {

constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();

TEST(Exact, ArithmeticReportsOverflowInsteadOfWrapping) {
  EXPECT_EQ(add(kMost - 1, 1), kMost);
  EXPECT_THROW(add(kMost, 1), AnalysisError);
  EXPECT_THROW(subtract(-kMost, 2), AnalysisError);
  EXPECT_THROW(multiply(kMost / 2 + 1, 2), AnalysisError);
  EXPECT_THROW(lcm(kMost, kMost - 1), AnalysisError);
  EXPECT_EQ(lcm(84, 200), 4200);
}

TEST(Exact, DivisionRoundsAsNamed) {
  EXPECT_EQ(ceil_div(0, 7), 0);
  EXPECT_EQ(ceil_div(7, 7), 1);
  EXPECT_EQ(ceil_div(8, 7), 2);
  EXPECT_EQ(floor_div(13, 7), 1);
}

TEST(Exact, UtilisationTellsOneFromItsNeighbours) {
  Utilisation thirds;
  for (int i = 0; i < 3; ++i) thirds.add(1, 3);
  EXPECT_EQ(thirds.compare_to_one(), 0);
  Utilisation less;
  less.add(kMost - 1, kMost);
  EXPECT_EQ(less.compare_to_one(), -1);
  Utilisation more;
  more.add(1, 3);
  more.add(666'666'666'666'666'667, 1'000'000'000'000'000'000);
  EXPECT_EQ(more.compare_to_one(), 1);
}

TEST(Exact, FixedPointStopsAtItsLimit) {
  const auto grow = [](std::int64_t w) { return w + 1; };
  EXPECT_EQ(least_fixed_point(0, grow, 10), std::nullopt);
  EXPECT_EQ(least_fixed_point(3, [](std::int64_t) { return std::int64_t{5}; }), 5);
  EXPECT_THROW(least_fixed_point(0, grow), AnalysisError);
}

}  // namespace hotpath::exact::exact_test
