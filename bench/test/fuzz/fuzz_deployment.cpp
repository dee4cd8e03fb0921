// SPDX-License-Identifier: Apache-2.0
#include "fuzz.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  static const Graph graph = load_graph(find_graph("autoware"));
  static const GraphTasks tasks = make_tasks(graph);
  return fuzz::read_or_refuse(
      [&] { static_cast<void>(find_deployment(file.hold(data, size), graph, tasks)); });
}
