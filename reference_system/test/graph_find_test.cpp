// SPDX-License-Identifier: Apache-2.0
// Graph names and the folders in which they are searched.
#include <gmock/gmock.h>

#include <cstdlib>
#include <map>

#include "graph_fixture.hpp"

namespace hotpath::graph_find_test {

namespace fs = std::filesystem;

class FindGraph : public testing::Test {
 protected:
  FindGraph() {
    const char* const node = "nodes: [{name: S, type: sensor, period_ms: 1}]\n";
    std::ofstream(folder_ / "mine.yaml") << "name: m\ndescription: my own\n" << node;
    std::ofstream(folder_ / "broken.yaml") << "name: m\n";
    setenv("HOTPATH_GRAPHS", ("/nonexistent:" + folder_.string()).c_str(), 1);
  }
  ~FindGraph() override { unsetenv("HOTPATH_GRAPHS"); }

  const Folder removed_;
  const fs::path folder_ = removed_.path();
};

TEST_F(FindGraph, LooksUpBareNamesInTheUsersFoldersAndThoseOfTheProgram) {
  EXPECT_EQ(find_graph("mine"), folder_ / "mine.yaml");
  EXPECT_EQ(fs::path(find_graph("autoware")).filename(), "autoware.yaml");
  fs::copy_file(folder_ / "mine.yaml", folder_ / "autoware.yaml");
  EXPECT_EQ(find_graph("autoware"), folder_ / "autoware.yaml") << "the user's first";
}

TEST_F(FindGraph, LeavesPathsAsTheyAreAndSuggestsTheNearestName) {
  EXPECT_EQ(find_graph((folder_ / "mine.yaml").string()), folder_ / "mine.yaml");
  EXPECT_THROW((void)find_graph((folder_ / "none.yaml").string()), InputError);
  EXPECT_THROW((void)find_graph("mine.yaml"), InputError);  // not in the working directory
  EXPECT_THAT([] { (void)find_graph("autowear"); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("did you mean `autoware`?")));
}

TEST_F(FindGraph, IsAnsweredByTheList) {
  std::map<std::string, FileListing> listed;
  for (const FileListing& listing : list_graphs()) listed[listing.name] = listing;
  EXPECT_EQ(listed["mine"].description, "my own");
  EXPECT_EQ(listed["mine"].nodes, 1U);
  EXPECT_EQ(listed["mine"].error, "");
  EXPECT_THAT(listed["broken"].error, testing::HasSubstr("`nodes` is missing"));
  for (const char* name : {"autoware", "timers_only_60", "timers_only_80", "timers_only_90",
                           "timers_only_60_authors", "timers_only_80_authors", "timers_only_90_authors",
                           "sequences", "sequences_high_utilisation", "many_to_many"}) {
    EXPECT_GT(listed[name].nodes, 0U) << name << listed[name].error;
    EXPECT_EQ(load_graph(find_graph(name)).name, name);
  }
}

}  // namespace hotpath::graph_find_test
