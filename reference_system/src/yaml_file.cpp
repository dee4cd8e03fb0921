// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/yaml_file.hpp"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <sstream>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/core/utf8.hpp"

namespace hotpath {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kFractionDigits = 6;  // from milliseconds to nanoseconds
constexpr std::size_t kIntegerDigits = 9;   // keeps sums of durations far from overflow

constexpr std::size_t kMaxFileBytes = std::size_t{4} << 20;

struct IgnoreEvents final : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}
};

/// Whether a document follows the first one. YAML::LoadAll() would return empty documents endlessly
/// for a text that is not YAML and begins with a comma.
bool has_second_document(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  IgnoreEvents events;
  return parser.HandleNextDocument(events) && parser.HandleNextDocument(events);
}

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

std::map<std::string, fs::path> yaml_files(const char* variable, const std::string& built_in) {
  const char* const given = std::getenv(variable);
  std::istringstream folders((given != nullptr ? std::string(given) + ":" : "") + built_in);
  std::map<std::string, fs::path> files;
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code error, ignored;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const fs::path& path = it->path();
      if (path.extension() == ".yaml" && !it->is_directory(ignored)) files.emplace(path.stem(), path);
    }
  }
  return files;
}

bool is_yaml_path(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  return name_or_path.find('/') != std::string::npos || path.extension() == ".yaml" ||
         path.extension() == ".yml";
}

std::string find_yaml(const std::string& kind, const std::map<std::string, fs::path>& files,
                      const std::string& name, std::vector<std::string> others) {
  if (const auto entry = files.find(name); entry != files.end()) return entry->second;
  for (const auto& [other, file] : files) others.push_back(other);
  throw InputError(name, 0, "there is no " + kind + " of this name",
                   suggest(name, others) + " (to give a file, include its extension .yaml)");
}

std::string read_text_file(const std::string& path) {
  const std::string remedy = "give the path of a readable YAML file";
  std::ifstream in = open_input(path, remedy);
  const auto text = std::make_unique_for_overwrite<char[]>(kMaxFileBytes + 1);
  in.read(text.get(), kMaxFileBytes + 1);
  const auto bytes = static_cast<std::size_t>(in.gcount());
  if (bytes > kMaxFileBytes) {
    throw InputError(path, 0, "the file has more than 4 MiB, the limit for this kind of file", remedy);
  }
  if (in.bad()) refuse_input(path, "input/output error", remedy);
  return {text.get(), bytes};
}

YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy) {
  YAML::Node document;
  bool several = false;
  try {
    document = YAML::Load(text);
    several = has_second_document(text);
  } catch (const YAML::Exception& error) {
    const int line = error.mark.is_null() ? 0 : error.mark.line + 1;
    throw InputError(file, line, "not valid YAML: " + error.msg,
                     "correct indentation, colons and quotes here");
  }
  if (several) throw InputError(file, 0, "the file holds several YAML documents", remedy);
  if (document.IsNull()) throw InputError(file, 0, "the file is empty", remedy);
  if (!document.IsMap()) throw InputError(file, 1, "the file is not a map of keys", remedy);
  return document;
}

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
      fail("`" + key + "` is not a key of " + what_, "its keys are: " + joined(known, ", "), line);
    fail("unknown key `" + key + "` in " + what_, suggest(key, known), line);
  }
}

void YamlMap::fail(const std::string& problem, const std::string& remedy, int line) const {
  throw InputError(*file_, line == 0 ? line_ : line, problem, remedy);
}

}  // namespace hotpath
