// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "hotpath/core/enum_text.hpp"

namespace hotpath::program {

using hotpath::concat, hotpath::joined;

/// printf's `format` as a string.
std::string text(const char* format, auto... values) {
  std::string result(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(result.data(), result.size() + 1, format, values...);
  return result;
}

/// Text as one field of a CSV file.
inline std::string csv_field(const std::string& field) {
  if (field.find_first_of(",\"\n") == std::string::npos) return field;
  std::string out = "\"";
  for (const char c : field) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

/// Text as one word of a shell's command line.
inline std::string shell_word(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_@%+=:,./-").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\"'\"'") : std::string(1, c);
  return quoted + "'";
}

/// `value` with so many decimals; `-` if it is not finite.
inline std::string fixed(double value, int decimals) {
  return std::isfinite(value) ? text("%.*f", decimals, value) : "-";
}

/// A sentence in lines of at most so many columns, each with its end.
inline std::string wrapped(const std::string& sentence, std::size_t columns = 100) {
  std::istringstream words(sentence);
  std::string lines, line;
  for (std::string word; words >> word;) {
    if (!line.empty() && line.size() + 1 + word.size() > columns) lines += std::exchange(line, "") + "\n";
    line += (line.empty() ? "" : " ") + word;
  }
  return lines + line + "\n";
}

}  // namespace hotpath::program
