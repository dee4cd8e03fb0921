// SPDX-License-Identifier: Apache-2.0
// Compares first timestamps of timers with rclcpp's rule and the recorded creation instants of the
// real stack.
#include "hotpath/reference_system/phases.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <stdexcept>

#include "graph_fixture.hpp"

namespace hotpath::phases_test {

using std::chrono::milliseconds;
using testing::ElementsAre;

const Graph& autoware() {
  static const Graph graph = load_graph(find_graph("autoware"));
  return graph;
}

std::string recorded_phases() { return std::string(HOTPATH_REFERENCE_DIR) + "/rclcpp_autoware_phases.csv"; }

Duration of(const std::vector<Duration>& phases, const std::string& timer) {
  return phases.at(task_named(make_tasks(autoware()), timer));
}

/// The first three tasks of many_to_many: timers SensorA (25), SensorB (41) and SensorC (51 ms).
std::vector<double> of_sensors(const std::vector<Duration>& phases) {
  return {to_ms(phases.at(0)), to_ms(phases.at(1)), to_ms(phases.at(2))};
}

class PhasesFile : public testing::Test {
 protected:
  std::vector<double> read(const std::string& text, const std::string& executor = "default") {
    return of_sensors(read_phases(File("phases.csv", text).path(), graph_, executor));
  }
  std::string error(const std::string& text, const std::string& executor = "default") {
    return error_of(text, [&](const std::string& path) { return read_phases(path, graph_, executor); });
  }

  const Graph graph_ = load_graph(find_graph("many_to_many"));
};

TEST(CreationPhases, AreCreationPlusPeriodWithOneStepPerNode) {
  PhaseOptions options;
  options.step = milliseconds(3);
  const auto phases = make_phases(autoware(), make_tasks(autoware()), Phases::creation, options);
  EXPECT_EQ(of(phases, "FrontLidarDriver"), milliseconds(100));
  EXPECT_EQ(of(phases, "RearLidarDriver"), milliseconds(103));
  EXPECT_EQ(of(phases, "EuclideanClusterSettings"), milliseconds(5 * 3 + 25));
  EXPECT_EQ(of(phases, "BehaviorPlanner"), milliseconds(20 * 3 + 100));
  EXPECT_EQ(of(phases, "RayGroundFilter/PointCloudFusion"), Duration::zero());
}

TEST(CreationPhases, CountPublishersAndSubscriptionsOfTheNodesBetween) {
  const auto instants = creation_instants(autoware(), make_tasks(autoware()));
  EXPECT_EQ(of(instants, "FrontLidarDriver"), Duration::zero());
  EXPECT_EQ(of(instants, "RearLidarDriver"), kNodeCreation + kEndpointCreation);
  // 20 nodes after the first, up to and including its own, with 45 publishers and subscriptions.
  EXPECT_EQ(of(instants, "BehaviorPlanner"), 20 * kNodeCreation + 45 * kEndpointCreation);
}

/// Normal equations of created = nodes * a + endpoints * b over all rows of the recorded instants.
TEST(CreationPhases, UseTheLeastSquaresFitToTheRecordedCreationInstants) {
  const std::map<std::string, std::pair<double, double>> counts = {{"RearLidarDriver", {1, 1}},
                                                                   {"PointCloudMap", {2, 2}},
                                                                   {"Visualizer", {3, 3}},
                                                                   {"Lanelet2Map", {4, 4}},
                                                                   {"EuclideanClusterSettings", {5, 5}},
                                                                   {"BehaviorPlanner", {20, 45}}};
  double nn = 0, ne = 0, ee = 0, ny = 0, ey = 0;
  for (const std::string executor :
       {"default", "static", "multi", "events-ro", "events-re", "rm-ro", "edf-ro"}) {
    const auto phases = read_phases(recorded_phases(), autoware(), executor);
    for (const auto& [timer, count] : counts) {
      const auto [n, e] = count;
      const double y = to_ms(of(phases, timer) - autoware().find(timer)->callbacks.back().period);
      nn += n * n, ne += n * e, ee += e * e, ny += n * y, ey += e * y;
    }
  }
  const double determinant = nn * ee - ne * ne;
  EXPECT_NEAR((ny * ee - ey * ne) / determinant, to_ms(kNodeCreation), 0.01);
  EXPECT_NEAR((nn * ey - ne * ny) / determinant, to_ms(kEndpointCreation), 0.01);
}

TEST(SynchronousPhases, AreAllAtTheEpoch) {
  const auto phases = make_phases(autoware(), make_tasks(autoware()), Phases::synchronous);
  EXPECT_EQ(phases, std::vector<Duration>(36));
}

TEST(GivenPhases, ComeFromTheGraphAndAreNeededForEveryTimer) {
  Graph graph = load_graph(find_graph("many_to_many"));
  graph.nodes[0].callbacks[0].phase = milliseconds(7);
  graph.nodes[1].callbacks[0].phase = milliseconds(0);
  EXPECT_THROW((void)make_phases(graph, make_tasks(graph), Phases::given), std::invalid_argument);
  graph.nodes[2].callbacks[0].phase = milliseconds(60);
  EXPECT_THAT(of_sensors(make_phases(graph, make_tasks(graph), Phases::given)), ElementsAre(7, 0, 60));
}

TEST(RandomPhases, AreReproducibleUniformAndBelowThePeriod) {
  const Graph graph = load_graph(find_graph("many_to_many"));
  const GraphTasks tasks = make_tasks(graph);
  PhaseOptions options;
  double sum = 0;
  constexpr int kSeeds = 2000;
  for (options.seed = 1; options.seed <= kSeeds; ++options.seed) {
    const auto phases = make_phases(graph, tasks, Phases::random, options);
    EXPECT_EQ(phases, make_phases(graph, tasks, Phases::random, options));
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (tasks.set[id].kind != TaskKind::timer) continue;
      ASSERT_GE(phases[id], Duration::zero());
      ASSERT_LT(phases[id], tasks.set[id].period);
      sum += to_ms(phases[id]) / to_ms(tasks.set[id].period);
    }
  }
  // Mean of 6000 uniform numbers, within six standard deviations.
  EXPECT_NEAR(sum / (3 * kSeeds), 0.5, 6 * std::sqrt(1.0 / 12 / (3 * kSeeds)));
}

/// The standard defines the 10000th number of mt19937_64 ([rand.predef]); the first number with
/// seed 1 follows from it.
TEST(RandomPhases, FollowTheStandardsGeneratorEverywhere) {
  const Graph graph = load_graph(find_graph("many_to_many"));
  PhaseOptions options;
  options.seed = 1;
  EXPECT_EQ(make_phases(graph, make_tasks(graph), Phases::random, options).front(),
            Duration(2469588189546311528ULL % 25'000'000));
}

TEST_F(PhasesFile, GivesFirstReleasesPerTask) {
  EXPECT_THAT(read("task,first_release_ms\nSensorA,1.5\n\nSensorC,0\r\nSensorB,3\n"), ElementsAre(1.5, 3, 0));
}

TEST_F(PhasesFile, AddsThePeriodToCreationInstants) {
  EXPECT_THAT(read("task,created_ms\nSensorA,0\nSensorB,2.744\nSensorC,5\n"), ElementsAre(25, 43.744, 56));
}

const std::string kWide =
    "executor,samples,created_ms_SensorA,created_ms_SensorB,created_ms_SensorC\n"
    "default,297,0.000,2.744,5.519\n"
    "rm-ro (first),247,0.000,3,6\nrm-ro (fifo),9,1,1,1\n"
    "edf-ro (first),9,1,1,1\nedf-ro,9,2,2,2\n";

TEST_F(PhasesFile, ChoosesTheRowOfTheExecutor) {
  EXPECT_THAT(read(kWide), ElementsAre(25, 43.744, 56.519));
  EXPECT_THAT(read(kWide, "rm-ro"), ElementsAre(25, 44, 57));
  EXPECT_EQ(read(kWide, "rm-ro (first)"), read(kWide, "rm-ro"));
  EXPECT_THAT(read(kWide, "edf-ro"), ElementsAre(27, 43, 53)) << "its own row, not the row of a rule";
}

TEST_F(PhasesFile, NamesTheLineOfEachMistake) {
  const std::string head = "task,first_release_ms\n";
  expect_error(error(""), kAnyLine, {"empty"});
  expect_error(error("timer,phase\n"), 1);
  expect_error(error(head + "SensorA,1\nSensorB,2\n"), 3, {"no phase for the timer of node SensorC"});
  expect_error(error(head + "SensorA,1\nSensrB,2\n"), 3, {"no timer SensrB", "did you mean `SensorB`?"});
  expect_error(error(head + "ProcessorX/Data,1\n"), 2, {"the graph has no timer"});
  expect_error(error(head + "SensorA,1\nSensorA,1\n"), 3, {"timer SensorA has a second phase"});
  expect_error(error(head + "SensorA,soon\n"), 2, {"the phase of timer SensorA is `soon`"});
  expect_error(error(head + "SensorA,-1\n"), 2);
  expect_error(error(head + "SensorA\n"), 2, {"1 columns instead of 2"});
  expect_error(error(kWide, "dm-ro"), 1, {"no row for executor dm-ro"});
  expect_error(error("executor,created_ms_SensorA,created_ms_SensorB\ndefault,1,2\n"), 1, {"node SensorC"});
  expect_error(error("executor,created_ms_Sensor\ndefault,1\n"), 2, {"the graph has no timer Sensor"});
  EXPECT_THROW((void)read_phases("/nonexistent.csv", graph_, "default"), InputError);
}

TEST_F(PhasesFile, TakesTheHeaderOfAGoldenTrace) {
  const auto header = [](const std::string& timer, const std::string& first) {
    return "# " + timer + " period_ns 200000000 wcet_ns 10000000 first_release_ns " + first + "\n";
  };
  const std::string job = "SensorA,0,239265435,249265477,400000000\n";
  EXPECT_THAT(
      read(header("SensorA", "200000001") + header("SensorB", "0") + header("SensorC", "5000000") + job),
      ElementsAre(200.000001, 0, 5));
  expect_error(error(header("SensorA", "1") + "# SensorB period\n" + job), 2,
               {"header line of a golden trace"});
  expect_error(error(header("SensorA", "1") + job), kAnyLine, {"no phase for the timer of node SensorB"});
}

}  // namespace hotpath::phases_test
