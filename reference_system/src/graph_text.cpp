// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace hotpath {

namespace {

constexpr std::size_t kFractionDigits = 6;  // from milliseconds to nanoseconds
constexpr std::size_t kIntegerDigits = 9;   // keeps sums of durations far from overflow

}  // namespace

std::optional<Duration> parse_ms(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view whole = text.substr(0, point);
  std::string fraction(text.substr(std::min(point + 1, text.size())));
  if (whole.empty() && fraction.empty()) return std::nullopt;
  while (fraction.size() > kFractionDigits && fraction.back() == '0') fraction.pop_back();
  if (whole.size() > kIntegerDigits || fraction.size() > kFractionDigits) return std::nullopt;
  fraction.resize(kFractionDigits, '0');
  const std::string digits = std::string(whole) + fraction;
  std::uint64_t ns = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), ns);
  if (end != digits.data() + digits.size()) return std::nullopt;  // not only digits
  return negative ? -Duration(ns) : Duration(ns);
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
