// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bound_properties.hpp"
#include "hotpath/analysis/graph_bounds.hpp"

namespace hotpath::test {
namespace {

class EveryBound : public testing::TestWithParam<Property> {};

TEST_P(EveryBound, HoldsForRandomGraphs) {
  const Property& property = GetParam();
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < property.cases; ++seed) {
    const CaseResult result = property.check(seed);
    ASSERT_EQ(result.wrong, "");
    jobs += result.jobs;
  }
  if (jobs == 0) GTEST_SKIP() << "no method bounds any of these graphs under " << property.name;
}

/// Graphs in which a state stands for schedules with earlier releases than those of the simulated one.
TEST(ExactValues, HoldForTheReleasesOfEverySchedule) {
  for (const auto& [executor, seed] :
       {std::pair{"static", 41'001'116}, {"rm-ro", 40'001'383}, {"events-ro", 41'000'304}}) {
    const CaseResult result = check_bounds(static_cast<std::uint64_t>(seed), executor, 0);
    EXPECT_EQ(result.wrong, "");
    EXPECT_GT(result.jobs, 0U) << executor;
  }
}

/// Without the check of one assumption, the search finds a wrong bound. Methods that do not cover
/// subscriptions also reject them as input.
struct Unchecked {
  const char* executor;
  Assumption assumption;
  std::uint64_t from = 0;  ///< First seed.
};

class EveryCheck : public testing::TestWithParam<Unchecked> {};

TEST_P(EveryCheck, IsNeeded) {
  for (std::uint64_t seed = GetParam().from; seed < GetParam().from + 2000; ++seed) {
    const auto result =
        check_bounds(seed, GetParam().executor, static_cast<std::uint32_t>(GetParam().assumption));
    if (!result.wrong.empty()) return;
  }
  FAIL() << "no bound was exceeded";
}

INSTANTIATE_TEST_SUITE_P(
    Assumptions, EveryCheck,
    testing::Values(
        Unchecked{"fp-ro", Assumption::fixed_priorities}, Unchecked{"edf-ro", Assumption::deadlines},
        Unchecked{"default", Assumption::polling}, Unchecked{"events-ro", Assumption::activation_order},
        Unchecked{"static", Assumption::other_order}, Unchecked{"rm-re", Assumption::runs_timers},
        Unchecked{"multi:2", Assumption::several_threads},
        Unchecked{"fp-ro:fifo", Assumption::ties_by_activation},
        Unchecked{"edf-ro", Assumption::mixed_deadlines}, Unchecked{"rm-ro", Assumption::wake_up},
        Unchecked{"rm-ro", Assumption::late_releases, 4'800}, Unchecked{"rm-ro", Assumption::delivery_delay},
        Unchecked{"rm-ro", Assumption::any_delivery}, Unchecked{"cbg:1", Assumption::woken_by_jobs, 29'000},
        Unchecked{"fp-ro", Assumption::service_wait, 2000}, Unchecked{"edf-ro", Assumption::service_wait}));

INSTANTIATE_TEST_SUITE_P(Executors, EveryBound, testing::ValuesIn(properties()), [](const auto& param) {
  std::string name = param.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace hotpath::test
