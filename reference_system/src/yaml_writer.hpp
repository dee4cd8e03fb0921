// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph_keys.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

/// Writes maps whose keys are in the table of keys.
class YamlWriter {
 public:
  YAML::Emitter out;

  YAML::Emitter& key(const std::string& name) { return out << YAML::Key << name << YAML::Value; }
  void words(const std::string& name, const std::vector<std::string>& list) {
    key(name) << YAML::Flow << list;
  }
  template <class T>
  void pair(const std::string& name, const T& value) {
    key(name) << as_text(value);
  }
  /// Writes the key unless it has the value that its absence means in this map.
  template <class T>
  void pair(KeysOf of, const std::string& name, const T& value) {
    if (as_text(value) != key_of(of, name).standard) pair(name, value);
  }
  template <class T>
  void pair(KeysOf of, const std::string& name, const std::optional<T>& value) {
    if (value) pair(of, name, *value);
  }

  /// Writes all keys of a list of graph_keys.
  template <class T>
  void pairs(KeysOf of, const auto& keys, const T& from) {
    std::apply([&](const auto&... key) { (pair(of, key.first, from.*key.second), ...); }, keys);
  }

 private:
  static std::string as_text(const std::string& text) { return text; }
  static std::string as_text(const char* text) { return text; }
  static std::string as_text(bool value) { return value ? "true" : "false"; }
  static std::string as_text(Duration time) { return format_ms(time); }
  static std::string as_text(std::integral auto number) { return std::to_string(number); }
  static std::string as_text(EnumWithTexts auto word) { return to_string(word); }
};

}  // namespace hotpath
