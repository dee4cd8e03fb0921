// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
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
inline std::string fixed(double value, int decimals) {
  return std::isfinite(value) ? text("%.*f", decimals, value) : "-";
}

inline std::string joined(const std::vector<std::string>& words, const std::string& separator = ", ") {
  std::string all;
  for (const std::string& word : words) all += (&word == words.data() ? "" : separator) + word;
  return all;
}

}  // namespace hotpath
