// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace hotpath {

template <class Enum>
using Named = std::vector<std::pair<std::string, Enum>>;

template <class Enum>
Named<Enum> named(std::initializer_list<Enum> values) {
  Named<Enum> names;
  for (const Enum v : values) names.emplace_back(to_string(v), v);
  return names;
}

/// An option that takes one of a few words, which stand in the help in place of the type.
template <class Enum, class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& option, Value& value, const Named<Enum>& names,
                        const std::string& help) {
  std::vector<std::string> words;
  std::string list;
  for (const auto& [word, meaning] : names) {
    words.push_back(word);
    list += (list.empty() ? "" : "|") + word;
  }
  const auto set = [&value, names](const std::string& text) {
    for (const auto& [word, meaning] : names) {
      if (word == text) value = meaning;
    }
  };
  return command.add_option_function<std::string>(option, set, help)
      ->check(CLI::IsMember(words).description(""))
      ->type_name(list);
}

template <class Value>
struct NumberOf {
  using Type = Value;
};
template <class Value>
struct NumberOf<std::optional<Value>> {
  using Type = Value;
};

/// A number within limits; whole if `value`, which may be optional, is.
template <class Value>
CLI::Option* add_number(CLI::App& command, const std::string& option, Value& value, double least, double most,
                        const std::string& unit, const std::string& help) {
  constexpr bool whole = std::is_integral_v<typename NumberOf<Value>::Type>;
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
