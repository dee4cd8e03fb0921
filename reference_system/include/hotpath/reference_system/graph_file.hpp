// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Limit of the bytes in a node name, except for type `callbacks`: the message reserves 48
/// including the closing NUL (upstream's TransmissionStats.idl).
inline constexpr std::size_t kMaxNameBytes = 47;

/// Limit of the nodes in one message's history, in graphs without nodes of type `callbacks`
/// (upstream's Message4kb.idl).
inline constexpr std::size_t kMaxHistory = 63;

/// Reads and checks a graph file: YAML with the keys in graph_keys.hpp, explained in docs/graphs.md. The
/// order of nodes is the order of creation. Milliseconds and microseconds are decimal and exact down to one
/// nanosecond. `set`: values for keys of nodes, as `NODE.KEY=VALUE` in the file's units, that replace those
/// of the file; NODE is a node, or a task of a node of type `callbacks`. Throws InputError for a file that
/// cannot be read, or that with these values is not a valid graph.
[[nodiscard]] Graph load_graph(const std::string& path, const std::vector<std::string>& set = {});

/// The path of a graph file. A name with a slash or ending in .yaml or .yml is a path already. A
/// bare name is searched as NAME.yaml in the folders of the environment variable HOTPATH_GRAPHS
/// (separated by colons), then in the built-in folders. Throws InputError if there is no such file.
[[nodiscard]] std::string find_graph(const std::string& name_or_path);

/// A file that is available by bare name: a graph, or a deployment.
struct FileListing {
  std::string name;  ///< The argument of find_graph or find_deployment: the file name without .yaml.
  std::string path;
  std::string description;
  std::size_t nodes = 0;  ///< Of a graph.
  /// The reason why the file is invalid; empty if it is valid. Owners of a deployment are not checked,
  /// because that requires a graph.
  std::string error;
};

/// All graphs that are available by bare name, sorted by name. If two files have the same name,
/// lists the one that find_graph takes.
[[nodiscard]] std::vector<FileListing> list_graphs();

/// The folder with the measurements of the real ROS 2 stack on the same workloads (its README
/// describes the files), in the source tree or the installation. std::nullopt if it is in neither.
[[nodiscard]] std::optional<std::filesystem::path> find_ros2_reference();

/// An input of a ReferenceNode.
struct ReferenceInput : Input {
  std::optional<std::int64_t> priority;  ///< Given fixed priority of the subscription.
};

/// A node of one of the six types of the reference system, in the short form of files. The comments name
/// the types to which a member applies. The timer is that of sensor and cyclic; a deadline of 0 is the
/// period.
struct ReferenceNode : StatedTimer {
  std::string name;
  NodeType type = NodeType::sensor;
  std::vector<ReferenceInput> inputs;
  std::vector<std::string> outputs;  ///< intersection: one per input; command: none; other types: one.
  Duration execution_time{};         ///< Work of one activation (worst case).
  Duration best_case_execution_time{};
  CallbackGroup group = CallbackGroup::mutually_exclusive;  ///< Of all callbacks.

  /// The node with its callbacks: subscriptions in input order, then the timer.
  operator Node() const;  // NOLINT(google-explicit-constructor): a node wherever a graph takes one
};

/// Comments of a written graph.
struct GraphComments {
  std::string header;                     ///< At the top of the file; may have several lines.
  std::map<std::string, std::string> of;  ///< One line each; key: the name of a node or of a callback's task.
};

/// Limit of measured execution times per callback in the graph's own file.
inline constexpr std::size_t kMaxInlineTimes = 20;

/// The graph as text from which load_graph() reads the same graph, including all measured execution
/// times. An unnamed group is read back as mutually exclusive.
[[nodiscard]] std::string graph_yaml(const Graph& graph, const GraphComments& comments = {});

/// Writes a text into a file; creates its folder if necessary.
using TextWriter = std::function<void(const std::filesystem::path& file, const std::string& text)>;

/// Writes the graph into `file` with `write`. If a callback has more than kMaxInlineTimes measured
/// execution times, they go into a CSV file in a folder beside `file`, called STEM_times after it.
/// The CSV files are written first. Throws InputError if the folder for `file` does not exist, and
/// exceptions of `write`.
void write_graph(const std::filesystem::path& file, const Graph& graph, const GraphComments& comments,
                 const TextWriter& write);

}  // namespace hotpath
