// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "bound_properties.hpp"

namespace hotpath::test {
namespace {

class EveryBound : public testing::TestWithParam<Property> {};

TEST_P(EveryBound, HoldsForRandomGraphs) {
  const Property& property = GetParam();
  for (std::uint64_t seed = 0; seed < property.cases; ++seed) {
    ASSERT_EQ(property.check(seed).wrong, "");
  }
}

INSTANTIATE_TEST_SUITE_P(Executors, EveryBound, testing::ValuesIn(properties()), [](const auto& param) {
  std::string name = param.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace hotpath::test
