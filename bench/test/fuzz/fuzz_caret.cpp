// SPDX-License-Identifier: Apache-2.0
// An architecture file of CARET is rejected, or it becomes a graph and a deployment that load.
#include <iostream>

#include "fuzz.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "import/import_caret.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  static const fuzz::TemporaryFolder folder;
  std::cout.setstate(std::ios::failbit);
  return fuzz::read_or_refuse([&] {
    const std::filesystem::path output = folder.path() / "output";
    std::filesystem::remove_all(output);
    imports::import_caret({.file = file.hold(data, size), .output = output});
    const Graph graph = load_graph(output / "graph.yaml");
    const std::string deployment = output / "deployment.yaml";
    if (std::filesystem::exists(deployment))
      static_cast<void>(find_deployment(deployment, graph, make_tasks(graph)));
  });
}
