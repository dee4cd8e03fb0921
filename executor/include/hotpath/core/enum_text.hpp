// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace hotpath {

/// An enumeration value and its word, the same in files, on the command line and in results.
template <class Enum>
struct EnumText {
  Enum value;
  const char* text;
};

/// The words of an enumeration whose values count from 0: one for each, in the order of the values.
template <class Enum, std::size_t n>
[[nodiscard]] constexpr std::array<EnumText<Enum>, n> texts_in_order(const char* const (&words)[n]) {
  std::array<EnumText<Enum>, n> texts{};
  for (std::size_t i = 0; i < n; ++i) texts[i] = {static_cast<Enum>(i), words[i]};
  return texts;
}

/// An enumeration with words: a function `enum_texts(Enum)` beside it returns an array of EnumText
/// for all values, in the order in which they are listed to the user.
template <class Enum>
concept EnumWithTexts = requires(Enum e) {
  enum_texts(e).front().text;
};

/// The word of a value; "?" for a value outside of the enumeration.
template <EnumWithTexts Enum>
[[nodiscard]] constexpr const char* to_string(Enum value) {
  constexpr auto texts = enum_texts(Enum{});
  for (const auto& t : texts) {
    if (t.value == value) return t.text;
  }
  return "?";
}

/// The value of a word; std::nullopt for any other text.
template <EnumWithTexts Enum>
[[nodiscard]] constexpr std::optional<Enum> parse(std::string_view text) {
  constexpr auto texts = enum_texts(Enum{});
  for (const auto& t : texts) {
    if (t.text == text) return t.value;
  }
  return std::nullopt;
}

/// All of `text` as a decimal number within the range of its type; std::nullopt for any other text.
template <class Number>
requires std::is_arithmetic_v<Number>
[[nodiscard]] std::optional<Number> parse(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// The parts, formatted by a stream and concatenated.
[[nodiscard]] std::string concat(const auto&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

/// Strings or numbers with a separator between them.
[[nodiscard]] std::string joined(const auto& items, std::string_view separator = ", ") {
  std::ostringstream all;
  for (std::string_view before = ""; const auto& item : items) {
    all << before << item;
    before = separator;
  }
  return all.str();
}

/// All words of an enumeration.
template <EnumWithTexts Enum>
[[nodiscard]] std::vector<std::string> words() {
  constexpr auto texts = enum_texts(Enum{});
  std::vector<std::string> all;
  all.reserve(texts.size());
  for (const auto& t : texts) all.emplace_back(t.text);
  return all;
}

}  // namespace hotpath
