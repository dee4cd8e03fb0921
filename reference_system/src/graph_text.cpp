// SPDX-License-Identifier: Apache-2.0
#include "graph_text.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace hotpath {

namespace {

constexpr std::size_t kFractionDigits = 6;  // of a millisecond down to a nanosecond
constexpr std::size_t kIntegerDigits = 9;   // keeps sums of durations far from overflow

bool all_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::int64_t to_integer(std::string_view digits) {
  return std::accumulate(digits.begin(), digits.end(), std::int64_t{0},
                         [](std::int64_t sum, char c) { return sum * 10 + (c - '0'); });
}

}  // namespace

std::optional<Duration> parse_ms(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view whole = text.substr(0, point);
  std::string fraction(text.substr(std::min(point + 1, text.size())));
  if (whole.empty() && fraction.empty()) return std::nullopt;
  if (!all_digits(whole) || !all_digits(fraction) || whole.size() > kIntegerDigits) return std::nullopt;
  while (fraction.size() > kFractionDigits && fraction.back() == '0') fraction.pop_back();
  if (fraction.size() > kFractionDigits) return std::nullopt;
  fraction.resize(kFractionDigits, '0');
  const std::int64_t ns = to_integer(whole) * 1'000'000 + to_integer(fraction);
  return Duration(negative ? -ns : ns);
}

std::string format_ms(Duration duration) {
  const std::int64_t ns = std::abs(duration.count());
  std::string text = (duration.count() < 0 ? "-" : "") + std::to_string(ns / 1'000'000);
  std::string fraction = std::to_string(ns % 1'000'000);
  fraction.insert(0, kFractionDigits - fraction.size(), '0');
  fraction.erase(fraction.find_last_not_of('0') + 1);
  return fraction.empty() ? text : text + "." + fraction;
}

bool is_utf8(std::string_view text) {
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // by bytes of a sequence
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i + k]));
    };
    const auto ones = static_cast<std::size_t>(std::countl_one(static_cast<unsigned char>(text[i])));
    const std::size_t bytes = ones == 0 ? 1 : ones;
    if (ones == 1 || ones > 4 || bytes > text.size() - i) return false;
    std::uint32_t code = bytes == 1 ? byte(0) : byte(0) & (0x7FU >> bytes);
    for (std::size_t k = 1; k < bytes; ++k) {
      if (byte(k) >> 6 != 0b10) return false;
      code = code << 6 | (byte(k) & 0x3FU);
    }
    if (code < kSmallest[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return false;
    i += bytes;
  }
  return true;
}

}  // namespace hotpath
