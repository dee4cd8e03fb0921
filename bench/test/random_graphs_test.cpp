// SPDX-License-Identifier: Apache-2.0
#include "random_graphs.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_writer.hpp"

namespace hotpath::test::random_graphs_test {
namespace {

TEST(RandomGraphs, AreWrittenAndReadBackAsTheyAre) {
  const std::filesystem::path file = testing::TempDir() + "hotpath_random_graph.yaml";
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const Graph graph = random_graph(random);
    write_graph(file, graph);
    ASSERT_EQ(load_graph(file), graph) << graph_yaml(graph);
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace hotpath::test::random_graphs_test
