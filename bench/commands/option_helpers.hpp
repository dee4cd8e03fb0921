// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

/// The type of a value that may be optional.
template <class Value>
struct Plain {
  using Type = Value;
};
template <class Value>
struct Plain<std::optional<Value>> {
  using Type = Value;
};

/// An option that takes one of an enumeration's words, which are shown in the help in place of the type.
template <class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& option, Value& value, const std::string& help) {
  using Enum = typename Plain<Value>::Type;
  std::string list;
  for (const std::string& word : words<Enum>()) list += (list.empty() ? "" : "|") + word;
  const auto set = [&value](const std::string& text) { value = *parse<Enum>(text); };
  return command.add_option_function<std::string>(option, set, help)
      ->check(CLI::IsMember(words<Enum>()).description(""))
      ->type_name(list);
}

/// A number within limits; whole if `value`, which may be optional, is.
template <class Value>
CLI::Option* add_number(CLI::App& command, const std::string& option, Value& value, double least, double most,
                        const std::string& unit, const std::string& help) {
  constexpr bool whole = std::is_integral_v<typename Plain<Value>::Type>;
  const char* const kind = whole ? "whole number" : "number";
  const auto check = [least, most, kind](const std::string& text) {
    std::conditional_t<whole, std::int64_t, double> number{};
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, number);
    const auto n = static_cast<double>(number);
    if (parsed.ec == std::errc{} && parsed.ptr == end && n >= least && n <= most) return std::string();
    std::ostringstream range;
    range << "`" << text << "` is not a " << kind << " from " << least << " to " << most;
    return range.str();
  };
  return command.add_option(option, value, help)->check(CLI::Validator(check, ""))->type_name(unit);
}

}  // namespace hotpath
