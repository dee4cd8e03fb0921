// SPDX-License-Identifier: Apache-2.0
// Checks invariants of the schedules of every executor, for thousands of random task sets and
// graphs; the program property_search checks millions.
#include "properties.hpp"

#include <gtest/gtest.h>

#include "task_sets.hpp"

namespace hotpath::test {
namespace {

class EveryProperty : public testing::TestWithParam<Property> {};

TEST_P(EveryProperty, HoldsForRandomTaskSets) {
  const Property& property = GetParam();
  std::size_t jobs = 0;
  for (std::uint64_t seed = 0; seed < property.cases; ++seed) {
    const CaseResult result = property.check(seed);
    ASSERT_EQ(result.wrong, "") << "seed " << seed;
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 10 * property.cases) << "too few jobs to check";
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryProperty, testing::ValuesIn(properties()),
                         [](const auto& property) { return identifier(property.param.name); });

class SectionVA : public testing::TestWithParam<const char*> {};

TEST_P(SectionVA, ReleaseOnlyAndReleaseAndExecuteDifferWhereAWcetExceedsAPeriodBecauseReleasesAreSkipped) {
  TaskSet set;
  const TaskId long_one = add_timer(set, 100ms, 25ms);
  const TaskId frequent = add_timer(set, 10ms, 1ms, 1ms);
  set.tasks[long_one].priority = 1;
  set.tasks[frequent].priority = 0;
  const Trace ro = run(set, std::string(GetParam()) + "-ro", 100ms);
  const Trace re = run(set, std::string(GetParam()) + "-re", 100ms);
  // Timestamps 1, 11 and 21 ms pass while the long job runs.
  EXPECT_EQ(skipped(ro, frequent), 0U);
  EXPECT_EQ(count(ro, frequent, Outcome::ran), 10U);
  EXPECT_EQ(skipped(re, frequent), 2U);
  EXPECT_EQ(count(re, frequent, Outcome::ran), 8U);
}

INSTANTIATE_TEST_SUITE_P(EveryPolicy, SectionVA, testing::Values("rm", "dm", "fp", "edf"));

}  // namespace
}  // namespace hotpath::test
