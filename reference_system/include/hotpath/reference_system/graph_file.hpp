// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
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

/// One graph file in these folders.
struct GraphListing {
  std::string name;  ///< The argument of find_graph: the file name without .yaml.
  std::string description;
  std::size_t nodes = 0;
  std::string path;
  std::string error;  ///< The reason why the file is not a valid graph; empty if it is valid.
};

/// All graphs that are available by bare name, sorted by name. If two files have the same name,
/// lists the one that find_graph takes.
[[nodiscard]] std::vector<GraphListing> list_graphs();

/// The folder with the measurements of the real ROS 2 stack on the same workloads (its README
/// describes the files), in the source tree or the installation. std::nullopt if it is in neither.
[[nodiscard]] std::optional<std::filesystem::path> find_ros2_reference();

}  // namespace hotpath
