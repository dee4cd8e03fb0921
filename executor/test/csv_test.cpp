// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/csv.hpp"

#include <gmock/gmock.h>

#include <sstream>

namespace hotpath::test::csv_test {

using testing::ElementsAre;
using testing::HasSubstr;

template <class Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Csv, FieldsAreFoundByTheNamesOfTheHeader) {
  std::istringstream in("name,count,mean\r\nIMU,12,1.5\r\n,-3,2e-3");
  CsvReader csv(LineReader(in, "a.csv"));
  EXPECT_THAT(csv.header(), ElementsAre("name", "count", "mean"));
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.line(), 2U);
  EXPECT_EQ(csv.text("name"), "IMU");
  EXPECT_EQ(csv.number<int>("count"), 12);
  EXPECT_EQ(csv.number<double>("mean"), 1.5);
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.text("name"), "");
  EXPECT_EQ(csv.number<int>(1), -3);
  EXPECT_EQ(csv.number<double>("mean"), 0.002);
  EXPECT_FALSE(csv.next());
  EXPECT_FALSE(csv.find_column("median"));
  EXPECT_THAT(refusal([&] { (void)csv.column("median"); }),
              HasSubstr("a.csv:1: there is no column `median`"));
}

TEST(Csv, MalformedFieldsAreNamedWithLineAndColumn) {
  std::istringstream in("name,count\nIMU,x\nIMU,300\nIMU,\n\nIMU,1,2\n");
  CsvReader csv(LineReader(in, "a.csv"));
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(refusal([&] { (void)csv.number<int>("count"); }),
            "a.csv:2: column 2 (count) is `x`; give a whole number in range");
  ASSERT_TRUE(csv.next());
  EXPECT_THAT(refusal([&] { (void)csv.number<std::uint8_t>("count"); }), HasSubstr("a.csv:3: "));
  ASSERT_TRUE(csv.next());
  EXPECT_THAT(refusal([&] { (void)csv.number<double>("count"); }), HasSubstr("is ``; give a number"));
  EXPECT_THAT(refusal([&] { (void)csv.next(); }), HasSubstr("a.csv:5: 1 columns instead of 2"));
  EXPECT_THAT(refusal([&] { (void)csv.next(); }), HasSubstr("a.csv:6: more than 2 columns"));
}

TEST(Csv, FilesWrittenByHandMayHaveBlanks) {
  std::istringstream in("\n name ,count\n\n\tIMU, 12\t\n \n");
  CsvReader csv(LineReader(in, "a.csv"), CsvLayout::by_hand);
  EXPECT_THAT(csv.header(), ElementsAre("name", "count"));
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.line(), 4U);
  EXPECT_EQ(csv.text(0), "IMU");
  EXPECT_EQ(csv.number<int>(1), 12);
  EXPECT_FALSE(csv.next());
}

TEST(Csv, AHeaderMayBeMissingWhereTheColumnsAreKnown) {
  for (const char* text : {"name,count\nIMU,1\n", "IMU,1\n"}) {
    std::istringstream in(text);
    CsvReader csv(LineReader(in, "a.csv"), CsvLayout::written, {"name", "count"});
    ASSERT_TRUE(csv.next());
    EXPECT_EQ(csv.text("name"), "IMU");
    EXPECT_FALSE(csv.next());
  }
}

TEST(Csv, AFileThatCannotBeReadAndADeviceWithoutEndAreNamed) {
  EXPECT_THAT(refusal([] { CsvReader csv("/nonexistent.csv"); }),
              HasSubstr("/nonexistent.csv: cannot be read (No such file"));
  EXPECT_THAT(refusal([] { CsvReader csv(std::filesystem::path("/tmp")); }), HasSubstr("cannot be read"));
  EXPECT_THAT(refusal([] { CsvReader csv("/dev/zero"); }),
              HasSubstr("it is a device, which may have no end"));
}

TEST(Csv, ALineWithoutEndIsRefused) {
  std::istringstream in("name\n" + std::string(5 << 20, 'a'));
  CsvReader csv(LineReader(in, "a.csv"));
  EXPECT_THAT(refusal([&] { static_cast<void>(csv.next()); }),
              HasSubstr("a.csv:2: the line has more than 4 MiB"));
}

}  // namespace hotpath::test::csv_test
