// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/utf8.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace hotpath {

namespace {

/// Size in bytes of the first UTF-8 character; 0 if there is none.
std::size_t first_character(std::string_view text) {
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // by length of the sequence
  if (text.empty()) return 0;
  const auto byte = [&](std::size_t k) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(text[k]));
  };
  const auto ones = static_cast<std::size_t>(std::countl_one(static_cast<unsigned char>(text[0])));
  const std::size_t bytes = ones == 0 ? 1 : ones;
  if (ones == 1 || ones > 4 || bytes > text.size()) return 0;
  std::uint32_t code = bytes == 1 ? byte(0) : byte(0) & (0x7FU >> bytes);
  for (std::size_t k = 1; k < bytes; ++k) {
    if (byte(k) >> 6 != 0b10) return 0;
    code = code << 6 | (byte(k) & 0x3FU);
  }
  return code < kSmallest[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000) ? 0 : bytes;
}

/// Whether a terminal or a log would not display it as a character of its line.
bool is_control(std::string_view character) {
  const auto within = [&](std::string_view first, std::string_view last) {
    return character.size() == first.size() && first <= character && character <= last;
  };
  using namespace std::string_view_literals;
  return within("\0"sv, "\x1f"sv) || within("\x7f"sv, "\x7f"sv) || within("\u0080"sv, "\u009f"sv) ||
         within("\u061c"sv, "\u061c"sv) || within("\u200e"sv, "\u200f"sv) || within("\u2028"sv, "\u202e"sv) ||
         within("\u2066"sv, "\u2069"sv);
}

std::string escaped(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 0xf]};
  }
  return text;
}

}  // namespace

bool is_utf8(std::string_view text) {
  std::size_t bytes = 0;
  for (; !text.empty(); text.remove_prefix(bytes)) {
    bytes = first_character(text);
    if (bytes == 0) return false;
  }
  return true;
}

std::string printable(std::string_view text, std::size_t most) {
  constexpr std::string_view kMore = "...";
  std::string result;
  std::size_t cut = 0;  // length of the result that leaves room for kMore
  while (!text.empty()) {
    const std::size_t bytes = first_character(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(bytes, 1));
    if (bytes == 0 || is_control(character)) {
      result += escaped(character);
    } else {
      result += character;
    }
    if (result.size() > most) return result.substr(0, cut).append(kMore);
    if (result.size() <= most - kMore.size()) cut = result.size();
    text.remove_prefix(character.size());
  }
  return result;
}

}  // namespace hotpath
