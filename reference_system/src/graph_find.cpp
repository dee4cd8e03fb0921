// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "graph_text.hpp"
#include "hotpath/reference_system/graph_file.hpp"

#ifndef HOTPATH_GRAPH_DIRS
#define HOTPATH_GRAPH_DIRS ""
#endif

namespace hotpath {

namespace {

namespace fs = std::filesystem;

void append_folders(std::vector<fs::path>& folders, const std::string& colon_separated) {
  std::size_t begin = 0;
  while (begin <= colon_separated.size()) {
    const std::size_t end = std::min(colon_separated.find(':', begin), colon_separated.size());
    if (end > begin) folders.emplace_back(colon_separated.substr(begin, end - begin));
    begin = end + 1;
  }
}

/// Name to path of all graph files in the folders; folders that do not exist hold none.
std::map<std::string, fs::path> graph_files() {
  std::vector<fs::path> folders;
  if (const char* given = std::getenv("HOTPATH_GRAPHS")) append_folders(folders, given);
  append_folders(folders, HOTPATH_GRAPH_DIRS);
  std::map<std::string, fs::path> files;
  for (const fs::path& folder : folders) {
    std::error_code error, ignored;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const fs::path& path = it->path();
      if (path.extension() == ".yaml" && !it->is_directory(ignored)) files.emplace(path.stem(), path);
    }
  }
  return files;
}

}  // namespace

std::string find_graph(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  std::error_code ignored;
  if (name_or_path.find('/') != std::string::npos || path.extension() == ".yaml" ||
      path.extension() == ".yml") {
    if (fs::exists(path, ignored)) return name_or_path;
    throw InputError(name_or_path, 0, "there is no such file",
                     "give the path of a graph file or one of the names of `hotpath list graphs`");
  }
  const auto files = graph_files();
  if (const auto found = files.find(name_or_path); found != files.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, file] : files) names.push_back(name);
  throw InputError(name_or_path, 0, "there is no graph of this name",
                   suggest(name_or_path, names) + " (a file is given with its extension .yaml)");
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
