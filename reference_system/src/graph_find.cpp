// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <sstream>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

std::map<std::string, fs::path> graph_files() { return yaml_files("HOTPATH_GRAPHS", HOTPATH_GRAPH_DIRS); }

}  // namespace

std::string find_graph(const std::string& name_or_path) {
  std::error_code error;
  if (is_yaml_path(name_or_path)) {
    if (fs::exists(fs::status(name_or_path, error))) return name_or_path;
    refuse_input(name_or_path, error.message(),
                 "give the path of a graph file or one of the names of `hotpath list graphs`");
  }
  return find_yaml("graph", graph_files(), name_or_path);
}

std::optional<fs::path> find_ros2_reference() {
  std::istringstream folders(HOTPATH_ROS2_REFERENCE_DIRS);
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code ignored;
    if (fs::is_directory(folder, ignored)) return folder;
  }
  return std::nullopt;
}

std::vector<GraphListing> list_graphs() {
  std::vector<GraphListing> listings;
  for (const auto& [name, path] : graph_files()) {
    GraphListing& listing = listings.emplace_back();
    listing.name = name;
    listing.path = path;
    try {
      const Graph graph = load_graph(path);
      listing.description = graph.description;
      listing.nodes = graph.nodes.size();
    } catch (const InputError& error) {
      listing.error = error.what();
    }
  }
  return listings;
}

}  // namespace hotpath
