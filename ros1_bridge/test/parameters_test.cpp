// SPDX-License-Identifier: Apache-2.0
#include "parameters.hpp"

#include <gmock/gmock.h>

#include <stdexcept>

namespace hotpath::parameters_test {

using testing::HasSubstr;
using XmlRpc::XmlRpcValue;

Parameters read(const XmlRpcValue& given, const std::string& node = "/bridge") {
  std::string unknown;
  Parameters parameters = read_parameters(given, node, unknown);
  EXPECT_EQ(unknown, "");
  return parameters;
}

std::string refusal(const std::string& name, const XmlRpcValue& value) {
  XmlRpcValue given;
  given[name] = value;
  try {
    read(given);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Parameters, HaveDefaults) {
  const Parameters p = read({});
  EXPECT_EQ(p.telemetry.domain, 0U);
  EXPECT_TRUE(p.points && p.clock && !p.telemetry.all_interfaces);
  EXPECT_EQ(p.frame, "hotpath");
  EXPECT_EQ(read({}, "/left/bridge").frame, "left/hotpath");
}

TEST(Parameters, AreTakenFromTheDictionary) {
  XmlRpcValue given;
  given["domain"] = 7;
  given["clock"] = false;
  given["frame"] = "map";
  const Parameters p = read(given);
  EXPECT_EQ(p.telemetry.domain, 7U);
  EXPECT_FALSE(p.clock);
  EXPECT_EQ(p.frame, "map");
}

TEST(Parameters, OfAnotherTypeOrRangeAreRefused) {
  for (const XmlRpcValue& wrong : {XmlRpcValue(-1), XmlRpcValue(233), XmlRpcValue(7.5), XmlRpcValue("7")})
    EXPECT_THAT(refusal("domain", wrong), HasSubstr("/bridge/domain must be a whole number, 0 to 232"));
  EXPECT_THAT(refusal("points", 1), HasSubstr("true or false"));
  EXPECT_THAT(refusal("frame", 1), HasSubstr("a text"));
}

TEST(Parameters, ThatDoNotExistAreReported) {
  XmlRpcValue given;
  given["graph_every"] = 2;
  given["domain"] = 1;
  std::string unknown;
  read_parameters(given, "/bridge", unknown);
  EXPECT_THAT(unknown, HasSubstr("ignored unknown parameters ~graph_every (`rosparam delete /bridge`"));
}

}  // namespace hotpath::parameters_test
