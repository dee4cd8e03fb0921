// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

/// Parses a decimal number of milliseconds ("4.2", "-1") as exact nanoseconds. std::nullopt for
/// other text, for more than nine digits before the point, and for digits below a nanosecond.
std::optional<Duration> parse_ms(std::string_view text);

/// Decimal milliseconds without trailing zeros: the inverse of parse_ms.
std::string format_ms(Duration duration);

/// Name and path of all files *.yaml in the folders of the environment variable, separated by
/// colons, then in `built_in`. Of two files with the same name the first one counts; folders that
/// do not exist count as empty.
std::map<std::string, std::filesystem::path> yaml_files(const char* variable, const std::string& built_in);

/// Whether the text is a path and not a bare name: it has a slash or ends in .yaml or .yml.
bool is_yaml_path(const std::string& name_or_path);

/// The path of the file with this name, of a `kind` of files. Throws InputError with the names that there
/// are, first those of `others`, which have no file.
std::string find_yaml(const std::string& kind, const std::map<std::string, std::filesystem::path>& files,
                      const std::string& name, std::vector<std::string> others = {});

/// Reads a regular text file of at most 4 MiB. Throws InputError.
std::string read_text_file(const std::string& path);

/// Parses a text that must be a map. `remedy` describes such a file. Throws InputError.
YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy);

/// Limit of the bytes in a topic name: leaves room for a prefix within the 255 bytes of DDS.
inline constexpr std::size_t kMaxTopicBytes = 200;

/// One value of a YAML file with its position and a description for messages. The conversions check
/// the value; all throw InputError.
class YamlValue {
 public:
  YamlValue(const std::string& file, const YAML::Node& node, std::string what, int line)
      : file_(&file), node_(node), what_(std::move(what)), line_(line) {}

  int line() const { return line_; }
  bool is_text() const { return node_.IsScalar(); }
  bool is_null() const { return node_.IsNull(); }
  bool is_list() const { return node_.IsSequence(); }

  /// Must be valid UTF-8.
  std::string text() const;
  /// A name for CSV columns and messages: no blanks, commas or quotes; for a node also no slash.
  std::string name() const { return checked_name(kMaxNameBytes, false); }
  /// A name that no message contains: of any length.
  std::string long_name() const { return checked_name(std::numeric_limits<std::size_t>::max(), false); }
  std::string topic() const { return checked_name(kMaxTopicBytes, true); }
  Duration milliseconds(bool zero_allowed) const {
    return duration(std::chrono::milliseconds(1), zero_allowed);
  }
  /// >= 0.
  Duration microseconds() const { return duration(std::chrono::microseconds(1), true); }
  /// In [0, 100].
  double percent() const;
  std::int64_t integer(std::int64_t least, std::int64_t most) const;
  /// Any integer except the extremes, which are reserved for "none".
  std::int64_t priority() const {
    using Limits = std::numeric_limits<std::int64_t>;
    return integer(Limits::min() + 1, Limits::max() - 1);
  }
  /// The index of the text among `choices`.
  std::size_t choice(const std::vector<std::string>& choices) const;
  template <EnumWithTexts Enum>
  Enum choice() const {
    return enum_texts(Enum{})[choice(words<Enum>())].value;
  }
  /// A list with at least one item; `what` names an item.
  std::vector<YamlValue> list(const std::string& item) const;
  /// A list that may be empty or null.
  std::vector<YamlValue> items(const std::string& item) const;

  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;

 private:
  friend class YamlMap;
  std::string checked_name(std::size_t most_bytes, bool slash) const;
  /// A decimal number of this unit, exact to the nanosecond.
  Duration duration(Duration unit, bool zero_allowed) const;

  const std::string* file_;
  YAML::Node node_;
  std::string what_;
  int line_;
};

/// A YAML map with distinct text keys. `what` names the map in messages.
class YamlMap {
 public:
  YamlMap(const YamlValue& value, std::string what);
  /// The map of a whole file with this text; `remedy` describes such a file. Keeps a pointer to `file`.
  YamlMap(const std::string& file, const std::string& text, const std::string& what,
          const std::string& remedy);

  int line() const { return line_; }
  const std::string& what() const { return what_; }
  void set_what(std::string what) { what_ = std::move(what); }

  std::vector<std::string> keys() const { return keys_; }

  std::optional<YamlValue> find(const std::string& key) const;
  YamlValue require(const std::string& key, const std::string& example) const;

  /// Rejects keys that are not among `known`; `elsewhere` are keys that are valid only for other
  /// kinds of objects.
  void check_keys(const std::vector<std::string>& known,
                  const std::vector<std::string>& elsewhere = {}) const;

  /// `line`: 0: of the map.
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy, int line = 0) const;

 private:
  const std::string* file_;
  std::string what_;
  int line_;
  std::vector<std::string> keys_;  ///< In file order.
  std::map<std::string, std::pair<int, YAML::Node>> values_;
};

}  // namespace hotpath
