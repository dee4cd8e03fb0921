// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace hotpath {

/// printf's `format` as a string.
std::string text(const char* format, auto... values) {
  std::string result(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(result.data(), result.size() + 1, format, values...);
  return result;
}

/// `-` for what is no finite number.
std::string fixed(double value, int decimals);

std::string joined(const std::vector<std::string>& words, const std::string& separator = ", ");

}  // namespace hotpath
