// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/deployment.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "graph_fixture.hpp"

namespace hotpath::deployment_test {

using testing::HasSubstr;

class Deployments : public testing::Test {
 protected:
  Deployment find(const std::string& name) { return find_deployment(name, graph, tasks); }

  const DeployedExecutor& of_task(const Deployment& d, const std::string& name) {
    return d.executors[d.executor_of[task_named(tasks, name)]];
  }

  /// The message for a file with these executors.
  std::string error(const std::string& executors) {
    return error_of("name: d\nexecutors:\n" + executors, [&](const std::string& path) { return find(path); });
  }

  const Graph graph = load_graph(find_graph("autoware"));
  const GraphTasks tasks = make_tasks(graph);
};

TEST_F(Deployments, EveryTaskHasAnExecutorInAllShippedDeployments) {
  std::vector<std::string> names;
  for (const DeploymentPreset& preset : deployment_presets()) names.emplace_back(preset.name);
  for (const FileListing& d : list_deployment_files()) {
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
  // Nodes of the six types have one callback group each.
  for (const char* name : {"isolated", "cie"})
    EXPECT_EQ(find(name).executors.size(), graph.nodes.size()) << name;
}

TEST_F(Deployments, AreWrittenAsTheyAreRead) {
  for (const char* const name : {"single", "isolated", "cie", "prioritized", "upstream_cbg", "picas"}) {
    const Deployment d = find(name);
    const Deployment read = find(File("written.yaml", deployment_yaml(graph, tasks, d)).path());
    EXPECT_EQ(read.executor_of, d.executor_of) << name;
    EXPECT_EQ(read.description, d.description) << name;
    const auto threads = [](const DeployedExecutor& e) {
      return std::tuple(e.name, e.executor, e.policy, e.processors);
    };
    EXPECT_TRUE(std::ranges::equal(read.executors, d.executors, {}, threads, threads)) << name;
  }
  EXPECT_THROW((void)deployment_yaml(graph, tasks, find("rm-threads")), std::invalid_argument)
      << "splits a group";
}

TEST_F(Deployments, ListedFilesComeWithDescriptionOrErrorAndPresetsHideThem) {
  const Folder removed;
  const std::filesystem::path folder = removed.path();
  for (const char* name : {"single.yaml", "plain.yaml"})
    std::ofstream(folder / name) << "name: n\nexecutors:\n  - {name: a, owns: rest}\n";
  std::ofstream(folder / "broken.yaml") << "name: broken\nexecuters: []\n";
  setenv("HOTPATH_DEPLOYMENTS", folder.c_str(), 1);
  const auto listings = list_deployment_files();
  unsetenv("HOTPATH_DEPLOYMENTS");
  const auto listed = [&](const std::string& name) {
    return std::ranges::find(listings, name, &FileListing::name);
  };
  EXPECT_EQ(listed("single"), listings.end());
  ASSERT_NE(listed("plain"), listings.end());
  EXPECT_EQ(listed("plain")->description + listed("plain")->error, "");
  ASSERT_NE(listed("broken"), listings.end());
  EXPECT_THAT(listed("broken")->error, HasSubstr("broken.yaml:2: "));
}

TEST_F(Deployments, RateMonotonicThreadsHaveHigherPrioritiesForShorterPeriods) {
  const Deployment d = find("rm-threads");
  const auto priority = [&](const std::string& task) { return of_task(d, task).policy.priority; };
  EXPECT_GT(priority("EuclideanClusterSettings"), priority("Visualizer"));
  EXPECT_GT(priority("Visualizer"), priority("FrontLidarDriver"));
  EXPECT_EQ(priority("PointsTransformerFront/FrontLidarDriver"), priority("FrontLidarDriver"));
  const auto of = [](const DeployedExecutor& e) { return e.policy.priority; };
  EXPECT_EQ(of(std::ranges::min(d.executors, {}, of)), 1);
}

TEST_F(Deployments, ExecutorsThatNameNoProcessShareOne) {
  const File file("processes.yaml",
                  "name: d\nexecutors:\n  - {name: a, owns: [Visualizer]}\n"
                  "  - {name: b, process: drivers, owns: [FrontLidarDriver]}\n  - {name: c, owns: rest}\n");
  const Deployment d = find(file.path());
  EXPECT_EQ(d.processes, (std::vector<std::string>{"", "drivers"}));
  const auto in = [](std::uint32_t process) { return testing::Field(&DeployedExecutor::process, process); };
  EXPECT_THAT(d.executors, testing::ElementsAre(in(0), in(1), in(0)));
  const std::vector<std::uint32_t> process = d.process_of(graph, tasks);
  EXPECT_EQ(process[static_cast<std::size_t>(graph.find("FrontLidarDriver") - graph.nodes.data())], 1U);
  EXPECT_EQ(std::ranges::count(process, 1U), 1);
  EXPECT_THAT(find("isolated").executors, testing::Each(in(0)));
}

TEST_F(Deployments, CallbackGroupsOfOneNodeCanHaveDifferentExecutors) {
  const Graph callbacks = load_graph(find_graph("callbacks"));
  const GraphTasks of = make_tasks(callbacks);
  const auto node = std::ranges::find_if(
      callbacks.nodes, [](const Node& n) { return n.groups.size() > 1 && !n.group_names.empty(); });
  ASSERT_NE(node, callbacks.nodes.end());
  const std::string first =
      "name: d\nexecutors:\n  - {name: a, owns: [" + node->name + "/" + node->group_names[0] + "]}\n";
  const auto read = [&](const std::string& path) { return find_deployment(path, callbacks, of); };
  const Deployment d = read(File("groups.yaml", first + "  - {name: b, owns: rest}\n").path());
  for (TaskId id = 0; id < of.set.size(); ++id) {
    const bool in_group = &callbacks.nodes[of.origin[id].node] == &*node && of.callbacks[id].group == 0;
    EXPECT_EQ(d.executor_of[id], in_group ? 0U : 1U) << of.set[id].name;
  }
  expect_error(error_of(first + "  - {name: b, process: other, owns: rest}\n", read), 4,
               {"two processes, with executors"});
}

/// A configuration file of CallbackIsolatedExecutor.
class CieFile : public Deployments {
 protected:
  std::string cie_error(const std::string& groups) {
    return error_of("callback_groups:\n" + groups,
                    [&](const std::string& path) { return find("cie:" + path); });
  }
};

TEST_F(CieFile, GivesThreadsToCallbackGroups) {
  const File file("threads.yaml", R"(callback_groups:

  - id: /FrontLidarDriver@Timer(100000000)
    affinity: [0, 1]
    policy: SCHED_FIFO
    priority: 50
  - id: /PointCloudFusion@Subscription(/PointsTransformerFront)@Subscription(/parameter_events)@Service(/a/b)@Subscription(/PointsTransformerRear)@Waitable
    affinity: ~
    policy: SCHED_DEADLINE
    runtime: 5000000
    deadline: 50000000
    period: 100000000
  - id: /Visualizer@Subscription(/parameter_events)@Service(/Visualizer/get_parameters)
    policy: SCHED_OTHER
    priority: 0
  - {id: /Visualizer@Timer(60000000), policy: SCHED_BATCH, nice: -5}
non_ros_threads: []
)");
  const Deployment d = find("cie:" + file.path());
  EXPECT_THAT(d.name, testing::MatchesRegex("cie:[0-9]+threads"));
  EXPECT_EQ(d.executor_of, find("cie").executor_of);
  const DeployedExecutor& lidar = of_task(d, "FrontLidarDriver");
  EXPECT_EQ(to_string(lidar.policy), "fifo:50");
  EXPECT_EQ(lidar.processors, (std::vector<int>{0, 1}));
  EXPECT_EQ(lidar.line, 3);
  EXPECT_EQ(to_string(of_task(d, "PointCloudFusion/PointsTransformerRear").policy), "deadline:5/50/100");
  EXPECT_EQ(to_string(of_task(d, "Visualizer").policy), "batch:-5");
  EXPECT_EQ(to_string(of_task(d, "PointCloudMap").policy), "other");
}

TEST_F(CieFile, IsWrittenAsItIsRead) {
  std::ostringstream first, second;
  write_cie(first, graph, tasks, find("cie"));
  EXPECT_THAT(first.str(), HasSubstr("  - id: /BehaviorPlanner@Subscription(/ObjectCollisionEstimator)@"));
  EXPECT_THAT(first.str(),
              HasSubstr("@Timer(100000000)\n    affinity: ~\n    policy: SCHED_OTHER\n    nice: 0\n"));
  Deployment changed = find("cie");
  changed.executors[0].policy = parse_thread_policy("fifo:7");
  changed.executors[0].processors = {3};
  changed.executors[1].policy = parse_thread_policy("deadline:1/2/3");
  changed.executors[2].policy = parse_thread_policy("idle:4");
  first.str("");
  write_cie(first, graph, tasks, changed);
  const Deployment read = find("cie:" + File("written.yaml", first.str()).path());
  write_cie(second, graph, tasks, read);
  EXPECT_EQ(first.str(), second.str());
  for (std::size_t e = 0; e < read.executors.size(); ++e)
    EXPECT_EQ(read.executors[e].policy, changed.executors[e].policy);
  EXPECT_THROW(write_cie(second, graph, tasks, find("single")), std::invalid_argument);
}

TEST_F(CieFile, MistakesAreReportedWithTheirLine) {
  const std::string imu = "  - id: /Visualizer@Timer(60000000)\n    policy: ";
  const std::string budget =
      "SCHED_DEADLINE\n    runtime: 20000000\n    deadline: 10000000\n    period: 10000000\n";
  const std::vector<Mistake> mistakes = {
      {"  - {id: /Visualizer@Timer(6000000), policy: SCHED_OTHER}\n", 2, {"`/Visualizer@Timer(60000000)`?"}},
      {"  - {id: /Nobody@Service(/a), policy: SCHED_OTHER}\n", kAnyLine, {"no callback group /Nobody"}},
      {imu + "SCHED_FIFO\n", kAnyLine, {"`priority` is missing"}},
      {imu + "SCHED_FIFO\n    priority: 100\n", 4},
      {imu + "FIFO\n", 3, {"SCHED_FIFO"}},
      {imu + budget, kAnyLine, {"at most the deadline"}},
      {imu + "SCHED_OTHER\n    colour: red\n", kAnyLine, {"unknown key `colour`"}},
      {imu + "SCHED_OTHER\n" + imu + "SCHED_OTHER\n", 4, {"occurs twice"}},
  };
  for (const Mistake& m : mistakes) expect_error(cie_error(m.text), m.line, m.parts);
}

TEST_F(Deployments, MistakesAreReportedWithTheirLine) {
  const std::string a = "  - {name: a, ", b = "  - {name: b, ", rest = "owns: rest}\n";
  const std::vector<Mistake> mistakes = {
      {a + "owns: [FrontLidarDrivr]}\n", 3, {"no node FrontLidarDrivr", "did you mean"}},
      {a + "owns: [Visualizer]}\n" + b + "owns: [Visualizer]}\n", 4, {"to executor a already"}},
      {a + "owns: [FrontLidarDriver]}\n", kAnyLine, {"no executor owns all callback groups of node"}},
      {a + rest + b + rest, kAnyLine, {"two executors own the rest"}},
      {a + rest + a + "owns: [Visualizer]}\n", kAnyLine, {"occurs twice"}},
      {a + "policy: 'fifo:100', " + rest, 3, {"fifo:100"}},
      {a + "policy: deadline, " + rest, kAnyLine, {"is not one of other"}},
      {a + "policy: 'deadline:20/10/10', " + rest, 3, {"at most the deadline"}},
      {a + "policy: 'deadline:1/10/10', processors: [0], " + rest, 3, {"cannot pin SCHED_DEADLINE threads"}},
      {a + "processors: [-1], " + rest, 3},
      {a + "processors: [0, 0], " + rest, kAnyLine, {"occurs twice"}},
      {a + "thread: 1, " + rest, kAnyLine, {"thread"}},
  };
  for (const Mistake& m : mistakes) expect_error(error(m.text), m.line, m.parts);
  EXPECT_THROW(static_cast<void>(find("isolatd")), InputError);
  Graph within = graph;
  within.intra_process.insert("FrontLidarDriver");
  expect_error(error_of("name: d\nexecutors:\n" + a + "process: p, owns: [FrontLidarDriver]}\n" + b + rest,
                        [&](const std::string& path) { return find_deployment(path, within, tasks); }),
               4, {"topic FrontLidarDriver is `intra_process`", "from executor a to b of another process"});
}

}  // namespace hotpath::deployment_test
