// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_text.hpp"

#include <algorithm>
#include <numeric>

namespace hotpath {

namespace {

constexpr std::size_t kFractionDigits = 6;  // from milliseconds to nanoseconds
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

}  // namespace hotpath
