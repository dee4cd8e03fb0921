// SPDX-License-Identifier: Apache-2.0
// The watcher on simulated runs: no false alarm, and a planted fault is named.
#include "watched_runs.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hotpath::test {
namespace {

class Watched : public testing::TestWithParam<Property> {};

TEST_P(Watched, NamesFaultsAndNothingElse) {
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < GetParam().cases; ++seed) {
    const CaseResult result = GetParam().check(seed);
    ASSERT_EQ(result.wrong, "");
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 0U);
}

std::string name_of(const testing::TestParamInfo<Property>& info) {
  std::string name = info.param.name;
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, Watched, testing::ValuesIn(properties()), name_of);

}  // namespace
}  // namespace hotpath::test
