// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hotpath/reference_system/graph_keys.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

/// The value of a key as a member of this type.
template <class T>
T value_as(const YamlValue& value, const GraphKey& key) {
  using enum ValueKind;
  if constexpr (std::is_same_v<T, std::string>) {
    return key.kind == name        ? value.name()
           : key.kind == long_name ? value.long_name()
           : key.kind == topic     ? value.topic()
                                   : value.text();
  } else if constexpr (requires(T optional) { optional.has_value(); }) {
    return value_as<typename T::value_type>(value, key);
  } else if constexpr (std::is_same_v<T, Duration>) {
    return value.milliseconds(key.kind == time);
  } else if constexpr (std::is_same_v<T, bool>) {
    return value.choice({"false", "true"}) == 1;
  } else if constexpr (std::is_floating_point_v<T>) {
    return value.percent() / 100;
  } else if constexpr (EnumWithTexts<T>) {
    return value.choice<T>();
  } else {
    return static_cast<T>(key.kind == priority ? value.priority() : value.integer(key.least, key.most));
  }
}

/// A map whose keys are in the table of keys. All functions throw InputError.
class GraphMap : public YamlMap {
 public:
  GraphMap(const YamlValue& value, std::string what, KeysOf of) : YamlMap(value, std::move(what)), of_(of) {}

  /// Rejects unknown keys, and by another message those of the maps `elsewhere` (bits).
  void check(std::uint32_t elsewhere = 0) const { check_keys(key_names(keys_in(of_)), key_names(elsewhere)); }
  void check_as(KeysOf of, std::uint32_t elsewhere) {
    of_ = of;
    check(elsewhere);
  }

  /// The value of a key that the map must have.
  [[nodiscard]] YamlValue needed(const std::string& key) const {
    return require(key, std::string(key_of(of_, key).example));
  }

  /// Reads the key into a member, which keeps its value if the key is absent.
  /// Returns whether it is there.
  template <class T>
  bool read(const std::string& key, T& to) const {
    const GraphKey& row = key_of(of_, key);
    const std::optional<YamlValue> given = row.example.empty() ? find(key) : needed(key);
    if (given) to = value_as<T>(*given, row);
    return given.has_value();
  }

  /// Reads all keys of a list of graph_keys.
  template <class T>
  void read_all(const auto& keys, T& to) const {
    std::apply([&](const auto&... key) { (read(key.first, to.*key.second), ...); }, keys);
  }

 private:
  KeysOf of_;
};

/// Default history depth of an input (upstream's nodes/settings.hpp).
inline std::uint32_t default_depth(NodeType type) { return type == NodeType::command ? 10 : 1; }

struct NodeLines {
  int node = 0;
  std::vector<int> inputs, outputs;
};

/// A graph with the line numbers of its nodes in the file.
struct GraphSource {
  std::string file;  ///< Its name in messages.
  std::filesystem::path folder;
  Graph graph;
  std::vector<NodeLines> nodes;  ///< Parallel to graph.nodes.
};

/// Lists files (yaml_files()); `describe` reads one, and throws InputError if it is invalid.
std::vector<FileListing> list_files(const std::map<std::string, std::filesystem::path>& files,
                                    const std::function<void(FileListing&)>& describe);

// The parts of a graph file, in this order. All functions throw InputError.

/// The topics that nodes publish, each once.
std::vector<std::string> published_topics(const Graph& graph);

/// Adds a node of any type.
void read_node(const YamlValue& value, GraphSource& source);

/// Checks that the nodes fit together; several of them may publish a topic of `shared`.
GraphTasks check_nodes(const GraphSource& source, const std::set<std::string>& shared);

/// Adds a chain. Without sources or sink, it has those of its ends.
void read_chain(const YamlValue& value, const GraphTasks& tasks, Graph& graph);

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
