// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/deployment.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Deployments : public testing::Test {
 protected:
  Deployment find(const std::string& name) { return find_deployment(name, graph, tasks); }

  /// The message for a file with these executors.
  std::string error(const std::string& executors) {
    const std::string path = testing::TempDir() + "deployment_test.yaml";
    std::ofstream(path) << "name: d\nexecutors:\n" << executors;
    try {
      static_cast<void>(find(path));
    } catch (const InputError& e) {
      return std::string(e.what()).substr(path.size());
    }
    return "";
  }

  const Graph graph = load_graph(find_graph("autoware"));
  const GraphTasks tasks = make_tasks(graph);
};

TEST_F(Deployments, EveryTaskHasAnExecutorInAllThatShip) {
  std::vector<std::string> names;
  for (const DeploymentPreset& preset : deployment_presets()) names.emplace_back(preset.name);
  for (const DeploymentListing& d : list_deployment_files()) {
    names.push_back(d.name);
    EXPECT_EQ(d.description, find(d.name).description);
    EXPECT_EQ(d.error, "");
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"single", "isolated", "cie", "rm-threads", "prioritized",
                                            "upstream_cbg", "picas"}));
  for (const std::string& name : names) {
    const Deployment d = find(name);
    EXPECT_EQ(d.name, name);
    ASSERT_EQ(d.executor_of.size(), tasks.set.size()) << name;
    const std::set<std::uint32_t> used(d.executor_of.begin(), d.executor_of.end());
    EXPECT_EQ(used.size(), d.executors.size()) << name;
  }
}

TEST_F(Deployments, ListedFilesComeWithDescriptionOrErrorAndPresetsHideThem) {
  const std::filesystem::path folder = testing::TempDir() + "deployment_test";
  std::filesystem::create_directory(folder);
  std::ofstream(folder / "single.yaml") << "name: single\nexecutors:\n  - {name: a, owns: rest}\n";
  std::ofstream(folder / "plain.yaml") << "name: plain\nexecutors:\n  - {name: a, owns: rest}\n";
  std::ofstream(folder / "broken.yaml") << "name: broken\nexecuters: []\n";
  setenv("HOTPATH_DEPLOYMENTS", folder.c_str(), 1);
  const auto listings = list_deployment_files();
  unsetenv("HOTPATH_DEPLOYMENTS");
  std::filesystem::remove_all(folder);
  const auto listed = [&](const std::string& name) {
    return std::ranges::find(listings, name, &DeploymentListing::name);
  };
  EXPECT_EQ(listed("single"), listings.end());
  ASSERT_NE(listed("plain"), listings.end());
  EXPECT_EQ(listed("plain")->description + listed("plain")->error, "");
  ASSERT_NE(listed("broken"), listings.end());
  EXPECT_THAT(listed("broken")->error, HasSubstr("broken.yaml:2: "));
}

TEST_F(Deployments, IsolatedHasAnExecutorForEachNodeAndCieForEachGroup) {
  EXPECT_EQ(find("isolated").executors.size(), graph.nodes.size());
  EXPECT_EQ(find("cie").executors.size(), graph.nodes.size());  // a group each in the six types
}

TEST_F(Deployments, RateMonotonicThreadsHaveHigherPrioritiesForShorterPeriods) {
  const Deployment d = find("rm-threads");
  const auto priority = [&](const std::string& task) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (tasks.set[id].name == task) return d.executors[d.executor_of[id]].policy.priority;
    }
    return -1;
  };
  EXPECT_GT(priority("EuclideanClusterSettings"), priority("Visualizer"));
  EXPECT_GT(priority("Visualizer"), priority("FrontLidarDriver"));
  EXPECT_EQ(priority("PointsTransformerFront/FrontLidarDriver"), priority("FrontLidarDriver"));
}

TEST_F(Deployments, CallbackGroupsOfOneNodeCanHaveDifferentExecutors) {
  const Graph callbacks = load_graph(find_graph("callbacks"));
  const GraphTasks of = make_tasks(callbacks);
  const Node* node = nullptr;
  for (const Node& n : callbacks.nodes) {
    if (n.groups.size() > 1 && !n.group_names.empty()) node = &n;
  }
  ASSERT_NE(node, nullptr);
  const std::string path = testing::TempDir() + "groups.yaml",
                    group = node->name + "/" + node->group_names[0];
  std::ofstream(path) << "name: d\nexecutors:\n  - {name: a, owns: [" << group
                      << "]}\n  - {name: b, owns: rest}\n";
  const Deployment d = find_deployment(path, callbacks, of);
  for (TaskId id = 0; id < of.set.size(); ++id) {
    const bool in_group = &callbacks.nodes[of.origin[id].node] == node && of.callbacks[id].group == 0;
    EXPECT_EQ(d.executor_of[id], in_group ? 0U : 1U) << of.set[id].name;
  }
}

TEST_F(Deployments, WhatIsWrongIsSaidWithItsLine) {
  EXPECT_THAT(error("  - {name: a, owns: [FrontLidarDrivr]}\n"),
              AllOf(HasSubstr(":3: "), HasSubstr("no node FrontLidarDrivr"), HasSubstr("did you mean")));
  EXPECT_THAT(error("  - {name: a, owns: [Visualizer]}\n  - {name: b, owns: [Visualizer]}\n"),
              AllOf(HasSubstr(":4: "), HasSubstr("belong to executor a already")));
  EXPECT_THAT(error("  - {name: a, owns: [FrontLidarDriver]}\n"),
              HasSubstr("no executor owns all callback groups of node"));
  EXPECT_THAT(error("  - {name: a, owns: rest}\n  - {name: b, owns: rest}\n"),
              HasSubstr("two executors own the rest"));
  EXPECT_THAT(error("  - {name: a, owns: rest}\n  - {name: a, owns: [Visualizer]}\n"),
              HasSubstr("occurs twice"));
  EXPECT_THAT(error("  - {name: a, policy: 'fifo:100', owns: rest}\n"),
              AllOf(HasSubstr(":3: "), HasSubstr("fifo:100")));
  EXPECT_THAT(error("  - {name: a, policy: deadline, owns: rest}\n"), HasSubstr("is not one of other"));
  EXPECT_THAT(error("  - {name: a, processors: [-1], owns: rest}\n"), HasSubstr(":3: "));
  EXPECT_THAT(error("  - {name: a, processors: [0, 0], owns: rest}\n"), HasSubstr("occurs twice"));
  EXPECT_THAT(error("  - {name: a, thread: 1, owns: rest}\n"), HasSubstr("thread"));
  EXPECT_THROW(static_cast<void>(find("isolatd")), InputError);
}

}  // namespace
}  // namespace hotpath
