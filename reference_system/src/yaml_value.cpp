// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/yaml_value.hpp"

#include <algorithm>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_text.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

constexpr std::string_view kNotInNames = ",\"'`";
/// Names and descriptions are written to JSON, which is UTF-8.
constexpr const char* kUtf8Remedy = "save the file in UTF-8";

/// yaml-cpp sets no mark for an empty value.
int line_of(const YAML::Node& node, int otherwise) {
  return node.Mark().is_null() ? otherwise : node.Mark().line + 1;
}

std::string kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return "`" + node.Scalar() + "`";
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a map";
    default:
      return "empty";
  }
}

}  // namespace

void YamlValue::fail(const std::string& problem, const std::string& remedy) const {
  throw InputError(*file_, line_, problem, remedy);
}

std::string YamlValue::text() const {
  if (!node_.IsScalar()) fail(what_ + " is " + kind_of(node_), "give one text");
  if (!is_utf8(node_.Scalar())) fail(what_ + " is not valid UTF-8", kUtf8Remedy);
  return node_.Scalar();
}

std::string YamlValue::checked_name(std::size_t most_bytes, bool slash) const {
  std::string name = text();
  if (name.empty()) fail(what_ + " is empty", "give 1 to " + std::to_string(most_bytes) + " bytes");
  if (name.size() > most_bytes) {
    fail(what_ + " `" + name + "` has " + std::to_string(name.size()) + " bytes",
         "give at most " + std::to_string(most_bytes));
  }
  const bool control = printable(name) != name;
  for (const char c : name) {
    if (control || c == ' ' || kNotInNames.find(c) != std::string_view::npos || (c == '/' && !slash)) {
      fail(what_ + " `" + name + "` contains " +
               (control || c == ' ' ? "a blank or control character" : std::string{c}),
           std::string("names are written into CSV columns: leave out blanks, commas, quotes") +
               (slash ? "" : " and slashes"));
    }
  }
  return name;
}

Duration YamlValue::duration(Duration unit, bool zero_allowed) const {
  const std::int64_t per_unit = Duration(std::chrono::milliseconds(1)) / unit;
  const std::string name = per_unit == 1 ? "milliseconds" : "microseconds";
  const std::optional<Duration> decimal = node_.IsScalar() ? parse_ms(node_.Scalar()) : std::nullopt;
  if (!decimal || decimal->count() % per_unit != 0) {
    fail(what_ + " is " + kind_of(node_), "give decimal " + name + " such as 4.2 (up to 999999999, at most " +
                                              (per_unit == 1 ? "six" : "three") + " digits after the point)");
  }
  const std::string remedy = (zero_allowed ? "give 0 or more " : "give more than 0 ") + name;
  if (*decimal < Duration::zero()) fail(what_ + " is negative (" + node_.Scalar() + ")", remedy);
  if (*decimal == Duration::zero() && !zero_allowed) fail(what_ + " is 0", remedy);
  return *decimal / per_unit;
}

double YamlValue::percent() const {
  // The same digits as milliseconds have.
  const std::optional<Duration> percent = node_.IsScalar() ? parse_ms(node_.Scalar()) : std::nullopt;
  if (!percent || *percent < Duration::zero() || *percent > std::chrono::milliseconds(100))
    fail(what_ + " is " + kind_of(node_), "give a percentage from 0 to 100 such as 62.5");
  return static_cast<double>(percent->count()) / 1e6;
}

std::int64_t YamlValue::integer(std::int64_t least, std::int64_t most) const {
  const std::string digits = node_.IsScalar() ? node_.Scalar() : std::string();
  const auto number = parse<std::int64_t>(digits);
  if (!number) fail(what_ + " is " + kind_of(node_), "give a whole number");
  if (*number < least || *number > most) {
    fail(what_ + " is " + digits,
         "give a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return *number;
}

std::size_t YamlValue::choice(const std::vector<std::string>& choices) const {
  const std::string word = node_.IsScalar() ? node_.Scalar() : std::string();
  const auto match = std::find(choices.begin(), choices.end(), word);
  if (match != choices.end()) return static_cast<std::size_t>(match - choices.begin());
  const auto best = nearest(word, choices);
  fail(what_ + " is " + kind_of(node_),
       "give one of: " + joined(choices, ", ") + (best ? " (did you mean `" + *best + "`?)" : ""));
}

std::vector<YamlValue> YamlValue::list(const std::string& item) const {
  if (!node_.IsSequence()) fail(what_ + " is " + kind_of(node_), "give a list");
  if (node_.size() == 0) fail(what_ + " is an empty list", "give at least one item");
  return items(item);
}

std::vector<YamlValue> YamlValue::items(const std::string& item) const {
  if (!node_.IsSequence() && !node_.IsNull()) fail(what_ + " is " + kind_of(node_), "give a list");
  std::vector<YamlValue> all;
  for (const YAML::Node& node : node_) all.emplace_back(*file_, node, item, line_of(node, line_));
  return all;
}

YamlMap::YamlMap(const YamlValue& value, std::string what)
    : file_(value.file_), what_(std::move(what)), line_(value.line_) {
  if (!value.node_.IsMap())
    value.fail(what_ + " is " + kind_of(value.node_), "give a map of `key: value` lines");
  for (const auto& entry : value.node_) {
    const YamlValue key(*file_, entry.first, "a key of " + what_, line_of(entry.first, line_));
    if (!key.is_text()) key.fail(key.what_ + " is " + kind_of(key.node_), "keys are words");
    keys_.push_back(key.text());
    const int line = line_of(entry.second, key.line_);
    const auto [previous, is_new] = values_.emplace(keys_.back(), std::pair(line, YAML::Node(entry.second)));
    if (!is_new)
      key.fail("`" + keys_.back() + "` occurs twice in " + what_,
               "keep one (the other is in line " + std::to_string(previous->second.first) + ")");
  }
}

YamlMap::YamlMap(const std::string& file, const std::string& text, const std::string& what,
                 const std::string& remedy)
    : YamlMap(YamlValue(file, read_yaml(file, text, remedy), what, 1), what) {}

std::optional<YamlValue> YamlMap::find(const std::string& key) const {
  const auto entry = values_.find(key);
  if (entry == values_.end()) return std::nullopt;
  return YamlValue(*file_, entry->second.second, "`" + key + "` of " + what_, entry->second.first);
}

YamlValue YamlMap::require(const std::string& key, const std::string& example) const {
  if (auto value = find(key)) return *value;
  fail("`" + key + "` is missing in " + what_, "add `" + key + ": " + example + "`");
}

void YamlMap::check_keys(const std::vector<std::string>& known,
                         const std::vector<std::string>& elsewhere) const {
  for (const std::string& key : keys_) {
    if (std::ranges::count(known, key) > 0) continue;
    const int line = values_.at(key).first;
    if (std::ranges::count(elsewhere, key) > 0)
      throw InputError(*file_, line, "`" + key + "` is not a key of " + what_,
                       "its keys are: " + joined(known, ", "));
    throw InputError(*file_, line, "unknown key `" + key + "` in " + what_, suggest(key, known));
  }
}

void YamlMap::fail(const std::string& problem, const std::string& remedy) const {
  throw InputError(*file_, line_, problem, remedy);
}

}  // namespace hotpath
