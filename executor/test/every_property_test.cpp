// SPDX-License-Identifier: Apache-2.0
// Checks the properties of a test program for random cases. A search for a counter-example has more of
// them: HOTPATH_CASES for each property, with the seeds from HOTPATH_SEED (default 0) on;
// --gtest_filter=*EveryProperty* chooses, and GTEST_TOTAL_SHARDS distributes them.
#include <gtest/gtest.h>

#include "properties.hpp"
#include "task_sets.hpp"

namespace hotpath::test::every_property_test {

class EveryProperty : public testing::TestWithParam<Property> {};

TEST_P(EveryProperty, HoldsForRandomCases) {
  const Property& property = GetParam();
  const std::uint64_t cases = from_environment("HOTPATH_CASES", property.cases),
                      first = from_environment("HOTPATH_SEED", 0);
  std::size_t jobs = 0;
  for (std::uint64_t seed = first; seed < first + cases; ++seed) {
    const CaseResult result = property.check(seed);
    ASSERT_EQ(result.wrong, "") << "HOTPATH_SEED=" << seed << " HOTPATH_CASES=1";
    jobs += result.jobs;
  }
  RecordProperty("jobs", std::to_string(jobs));
  EXPECT_GE(jobs, property.fewest_jobs * cases) << "too few jobs to check";
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryProperty, testing::ValuesIn(properties()),
                         [](const auto& property) { return identifier(property.param.name); });

}  // namespace hotpath::test::every_property_test
