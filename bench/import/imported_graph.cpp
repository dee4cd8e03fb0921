// SPDX-License-Identifier: Apache-2.0
#include "import/imported_graph.hpp"

#include <filesystem>
#include <iostream>

#include "hotpath/reference_system/graph_file.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::imports {

std::string counts_of(const ImportedGraph& imported) {
  std::size_t timers = 0, subscriptions = 0;
  for (const Node& node : imported.graph.nodes) {
    subscriptions += node.inputs.size();
    timers += node.callbacks.size() - node.inputs.size();
  }
  const std::size_t chains = imported.graph.chains.size();
  return program::concat(imported.graph.nodes.size(), " nodes, ", timers, " timers, ", subscriptions,
                         " subscriptions, ", imported.deployment.executors.size(), " executors",
                         chains > 0 ? program::concat(", ", chains, " chains.") : std::string("."));
}

void write_import(ImportedGraph imported, const std::string& folder) {
  const std::filesystem::path path = folder, file = path / "graph.yaml";
  program::check_output_folder(path);
  program::create_folder(path);
  std::string& header = imported.comments.header;
  for (const std::string& line : imported.summary) header += "\n" + line;
  for (const std::string& line : imported.missing) header += "\nNot known: " + line;
  write_graph(file, imported.graph, imported.comments, program::write_with_folder);
  const Graph graph = load_graph(file);  // throws if the written file is not valid
  for (const std::string& line : imported.summary) std::cout << line << "\n";
  for (const std::string& line : imported.missing) std::cout << "Not known: " << line << "\n";
  std::cout << "\nGraph: " << file.string() << "\n";
  if (imported.deployment.executors.empty()) return;
  const std::filesystem::path deployment = path / "deployment.yaml";
  try {
    program::write_whole_file(deployment, deployment_yaml(graph, make_tasks(graph), imported.deployment));
    std::cout << "Deployment: " << deployment.string() << "\n";
  } catch (const std::invalid_argument& error) {
    std::cout << "No deployment is written: " << error.what() << "; write one by hand.\n";
  }
}

}  // namespace hotpath::imports
