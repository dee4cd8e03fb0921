// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <gmock/gmock.h>

#include <stdexcept>

#include "master.hpp"

namespace hotpath::names_test {

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

TEST(RosName, IsNotLongerThan200Characters) {
  EXPECT_EQ(ros_name(std::string(200, 'a')), std::string(200, 'a'));
  EXPECT_EQ(ros_name(std::string(1'000'000, 'a')), std::string(200, 'a'));
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

// An algorithm that compares each name with all earlier names would exceed the test's time limit.
TEST(RosNames, ManyMayBeTheSame) {
  constexpr std::size_t kMany = 200'000;
  const RosNames result = ros_names(std::vector<std::string>(kMany, "a"));
  EXPECT_EQ(result.names.back(), "a_" + std::to_string(kMany));
}

TEST(MasterUri, IsTakenApart) {
  EXPECT_EQ(parse_uri("http://localhost:11311").host, "localhost");
  EXPECT_EQ(parse_uri("http://10.0.0.1:80/").port, "80");
}

TEST(MasterUri, IsRefusedWhenItHasAnotherForm) {
  for (const char* uri :
       {"", "localhost:11311", "http://localhost", "http://:11311", "https://a:1", "http://a:b"}) {
    EXPECT_THROW(parse_uri(uri), std::invalid_argument) << uri;
  }
}

TEST(AcceptsConnections, NotWhereNobodyListens) {
  EXPECT_FALSE(accepts_connections({"127.0.0.1", "1"}, std::chrono::seconds(10)));
  EXPECT_FALSE(accepts_connections({"no-such-host.invalid", "80"}, std::chrono::seconds(10)));
}

}  // namespace hotpath::names_test
