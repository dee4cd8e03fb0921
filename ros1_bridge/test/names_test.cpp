// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hotpath {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(RosName, KeepsLegalNames) {
  EXPECT_EQ(ros_name("FrontLidarDriver"), "FrontLidarDriver");
  EXPECT_EQ(ros_name("timer_2"), "timer_2");
}

TEST(RosName, ReplacesEachIllegalByte) {
  EXPECT_EQ(ros_name("hot path/1"), "hot_path_1");
  EXPECT_EQ(ros_name("\xc3\xbc"), "__");
  EXPECT_EQ(ros_name(""), "_");
}

TEST(RosNames, TellsClashingNamesApartAndReportsThem) {
  const RosNames result = ros_names({"a-b", "a b", "c", "a_b"});
  EXPECT_THAT(result.names, ElementsAre("a_b", "a_b_2", "c", "a_b_3"));
  EXPECT_THAT(result.clashes, ElementsAre("`a-b` and `a b`", "`a-b` and `a_b`"));
}

TEST(RosNames, ANumberedNameMayBeTakenAlready) {
  EXPECT_THAT(ros_names({"a_2", "a", "a"}).names, ElementsAre("a_2", "a", "a_3"));
  EXPECT_THAT(ros_names({"a", "b"}).clashes, IsEmpty());
}

}  // namespace hotpath
