// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace hotpath {

constexpr int kAnyLine = 0;

/// Expects a message `:LINE: ...`, without the name of the file, that has these parts.
inline void expect_error(const std::string& message, int line, const std::vector<const char*>& parts = {}) {
  if (line != kAnyLine) {
    EXPECT_THAT(message, testing::StartsWith(":" + std::to_string(line) + ": "));
  }
  for (const char* part : parts) EXPECT_THAT(message, testing::HasSubstr(part));
}

}  // namespace hotpath
