// SPDX-License-Identifier: Apache-2.0
#include "master.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace hotpath::master_test {

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

}  // namespace hotpath::master_test
