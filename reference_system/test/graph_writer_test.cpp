// SPDX-License-Identifier: Apache-2.0
// Written graphs are read back as the same graphs.
#include "hotpath/reference_system/graph_file.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/graph_keys.hpp"

namespace hotpath::graph_writer_test {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

TEST(GraphWriter, WritesEveryFeatureOfAGraph) {
  std::vector<Graph> graphs = {load(kEverything)};
  for (const FileListing& listing : list_graphs()) graphs.push_back(load_graph(listing.path));
  for (const GraphKey& key : graph_keys::kAll) {  // of timers
    if ((key.of & graph_keys::kTimed) != graph_keys::kTimed || key.name == "period_ms") continue;
    graphs.push_back(
        load("nodes: [{name: S, type: sensor, period_ms: 9, " + std::string(key.name) + ": 1}]\nname: g"));
    EXPECT_THAT(graph_yaml(graphs.back()), HasSubstr(std::string(key.name) + ": 1"));
  }
  for (const Graph& graph : graphs) EXPECT_EQ(load(graph_yaml(graph)), graph) << graph_yaml(graph);
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directory(file.parent_path());
  std::ofstream(file) << text;
}

TEST(GraphWriter, PutsLongMeasurementsIntoFilesBesideTheGraph) {
  Graph graph = load(kEverything);
  std::vector<Duration> times(kMaxInlineTimes + 1, 5ms);
  times[3] = 1ns;
  Callback& callback = graph.nodes.back().callbacks[1];
  callback.measured = std::make_shared<const std::vector<Duration>>(times);
  callback.best = 1ns;
  callback.worst = 5ms;
  const Folder removed;
  const fs::path folder = removed.path();
  write_graph(folder / "mine.yaml", graph, {}, write);
  EXPECT_TRUE(fs::exists(folder / "mine_times" / "K-a.csv"));
  EXPECT_EQ(load_graph(folder / "mine.yaml"), graph);
}

TEST(GraphWriter, WritesTheComments) {
  const Graph graph = load(kEverything);
  const std::string text =
      graph_yaml(graph, {"Imported.\nBy test.", {{"S", "a sensor"}, {"K", "a node"}, {"K/a", "half known"}}});
  EXPECT_THAT(text, AllOf(HasSubstr("# Imported.\n# By test.\n"), HasSubstr("}  # a sensor\n"),
                          HasSubstr("name: K  # a node\n"), HasSubstr("}  # half known\n")));
  EXPECT_EQ(load(text), graph);
}

TEST(GraphWriter, NamesTheFileThatCannotBeWritten) {
  EXPECT_THAT([] { write_graph("/nonexistent/mine.yaml", load(kEverything), {}, write); },
              testing::ThrowsMessage<InputError>(HasSubstr("mine.yaml")));
}

}  // namespace hotpath::graph_writer_test
