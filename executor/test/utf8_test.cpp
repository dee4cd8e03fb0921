// SPDX-License-Identifier: Apache-2.0
// Conversion of untrusted text for terminals and logs.
#include "hotpath/core/utf8.hpp"

#include <gtest/gtest.h>

namespace hotpath::test::utf8_test {

TEST(Printable, KeepsUtf8) {
  EXPECT_EQ(printable("hot_path", 200), "hot_path");
  EXPECT_EQ(printable("\u00fc \u20ac \U0001f600", 200), "\u00fc \u20ac \U0001f600");
  EXPECT_EQ(printable("", 200), "");
}

TEST(Printable, EscapesControlCharactersAndInvalidUtf8) {
  EXPECT_EQ(printable(std::string("a\0b\n\x1b[2J\x7f", 9), 200), "a\\x00b\\x0a\\x1b[2J\\x7f");
  EXPECT_EQ(printable("\xff\xc3", 200), "\\xff\\xc3");
  EXPECT_EQ(printable("\u009b\u2028\u202e\u2066"), "\\xc2\\x9b\\xe2\\x80\\xa8\\xe2\\x80\\xae\\xe2\\x81\\xa6");
}

TEST(Printable, CutsBetweenCharacters) {
  EXPECT_EQ(printable("abcdef", 6), "abcdef");
  EXPECT_EQ(printable("abcdefg", 6), "abc...");
  EXPECT_EQ(printable("\u20ac\u20ac\u20ac", 8), "\u20ac...");
  EXPECT_EQ(printable("a\x01\x01", 8), "a\\x01...");
}

}  // namespace hotpath::test::utf8_test
