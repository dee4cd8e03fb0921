// SPDX-License-Identifier: Apache-2.0
// The search of phases against functions whose best phases are known, and against all phases of a grid.
#include "advise/phase_search.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TaskSet timers(const std::vector<Duration>& periods) {
  TaskSet set;
  for (const Duration period : periods) {
    Task& task = set.tasks.emplace_back();
    task.name = "T" + std::to_string(set.tasks.size());
    task.period = task.deadline = period;
  }
  return set;
}

advise::PhaseSearchOptions threads(unsigned count) {
  advise::PhaseSearchOptions options;
  options.threads = count;
  return options;
}

TEST(Ranges, AreThePhasesThatChangeADistanceToAnotherTimer) {
  EXPECT_EQ(advise::range_of_phases(timers({60ms, 100ms}), {0}), 20ms);
  EXPECT_EQ(advise::range_of_phases(timers({25ms, 100ms, 60ms}), {0}), 25ms);
  EXPECT_EQ(advise::range_of_phases(timers({7ms, 11ms}), {0}), 1ms);
  EXPECT_EQ(advise::range_of_phases(timers({100ms, 100ms, 60ms}), {0, 1}), 20ms) << "the two move together";
  EXPECT_EQ(advise::range_of_phases(timers({100ms}), {0}), Duration(1)) << "a single timer has no distance";
}

TEST(PhaseSearch, ReachesTheMiddleOfThePhasesThatAreEquallyGood) {
  const TaskSet set = timers({100ms, 100ms, 50ms});
  // Best where the second timer is 30 to 50 ms behind the first, and the third 10 to 20 ms.
  const auto outside = [](Duration x, Duration least, Duration most) {
    return to_ms(std::max({Duration::zero(), least - x, x - most}));
  };
  const auto score = [&](const advise::FirstTimestamps& first, const advise::PhaseScore&) {
    const Duration second = (first[1] - first[0] + 100ms) % 100ms,
                   third = (first[2] - first[0] + 100ms) % 50ms;
    return advise::PhaseScore{outside(second, 30ms, 50ms) + outside(third, 10ms, 20ms), 0, 0};
  };
  const advise::FoundPhases found = advise::search_phases(set, {}, {{0ms, 90ms, 3ms}}, score, threads(1));
  EXPECT_EQ(found.score.value, 0);
  EXPECT_TRUE(found.complete);
  EXPECT_NEAR(to_ms((found.first[1] - found.first[0] + 100ms) % 100ms), 40, 4);
  EXPECT_NEAR(to_ms((found.first[2] - found.first[0] + 100ms) % 50ms), 15, 2);
}

TEST(PhaseSearch, MovesTimersTogetherWhereOneAloneWouldBeWorse) {
  const TaskSet set = timers({100ms, 100ms, 100ms});
  const auto score = [&](const advise::FirstTimestamps& first, const advise::PhaseScore&) {
    const double apart = to_ms(std::chrono::abs(first[1] - first[2]));
    const double away = to_ms(std::chrono::abs((first[1] - first[0] + 100ms) % 100ms - 50ms));
    return advise::PhaseScore{100 * apart + away, 0, 0};
  };
  EXPECT_GT(advise::search_phases(set, {}, {{0ms, 0ms, 0ms}}, score, threads(1)).score.value, 40);
  EXPECT_LT(advise::search_phases(set, {1, 2}, {{0ms, 0ms, 0ms}}, score, threads(1)).score.value, 1);
}

TEST(PhaseSearch, TakesNoPhasesWhoseScoreIsOnlyKnownToBeGreater) {
  const TaskSet set = timers({100ms, 100ms});
  const auto whole = [](const advise::FirstTimestamps& first) {
    return to_ms((first[1] - first[0] + 130ms) % 100ms);  // least 30 ms before the first timer
  };
  const auto early = [&](const advise::FirstTimestamps& first, const advise::PhaseScore& enough) {
    return advise::PhaseScore{
        whole(first) > enough.value ? std::nextafter(enough.value, 1000.0) : whole(first), 0, 0};
  };
  const advise::FoundPhases found =
      advise::search_phases(set, {}, {{0ms, 69ms}, {0ms, 20ms}, {0ms, 45ms}}, early, threads(1));
  EXPECT_EQ(found.score.value, whole(found.first));
  EXPECT_LT(found.score.value, 1);
}

TEST(PhaseSearch, KeepsTheBestWhenItIsStopped) {
  const TaskSet set = timers({100ms, 100ms});
  const auto score = [](const advise::FirstTimestamps& first, const advise::PhaseScore&) {
    return advise::PhaseScore{to_ms((first[1] - first[0] + 100ms) % 100ms), 0, 0};
  };
  int asked = 0;
  advise::PhaseSearchOptions options = threads(1);
  options.stop = [&] { return ++asked > 2; };
  const advise::FoundPhases found =
      advise::search_phases(set, {}, {{0ms, 60ms}, {0ms, 50ms}}, score, options);
  EXPECT_FALSE(found.complete);
  EXPECT_LT(found.score.value, 60);
  EXPECT_EQ(found.score.value, score(found.first, {}).value);
  options.stop = [] { return true; };
  EXPECT_EQ(advise::search_phases(set, {}, {{0ms, 60ms}}, score, options).first,
            (advise::FirstTimestamps{0ms, 60ms}));
}

/// Three sensors whose data meet in two joins, with work between.
Graph three_sensors() {
  Graph graph;
  const auto add = [&](const char* name, NodeType type, std::vector<std::string> inputs, Duration period) {
    Node& node = graph.nodes.emplace_back();
    node.name = name;
    node.type = type;
    for (std::string& input : inputs) node.inputs.push_back({std::move(input), 1, std::nullopt});
    node.outputs = {name};
    node.period = node.deadline = period;
    node.execution_time = 6ms;
    node.best_case_execution_time = 2ms;
  };
  add("P", NodeType::sensor, {}, 40ms);
  add("Q", NodeType::sensor, {}, 40ms);
  add("R", NodeType::sensor, {}, 60ms);
  add("F", NodeType::fusion, {"P", "Q"}, {});
  graph.chains = {{"c", {"P", "Q", "F"}, {"P", "Q"}, "F"}};
  return graph;
}

class SearchOfGraph : public testing::Test {
 protected:
  advise::FoundPhases searched(unsigned thread_count) const {
    const auto score = [&](const advise::FirstTimestamps& first, const advise::PhaseScore&) {
      return evaluator_.at(first).score;
    };
    return advise::search_phases(candidate_.tasks.set, {0, 1}, {start_}, score, threads(thread_count));
  }

  const Graph graph_ = three_sensors();
  const advise::Objective objective_ = advise::parse_objective("c:age", graph_);
  const advise::Candidate candidate_ =
      advise::make_candidates(graph_, objective_, {{"rm-ro"}, {}, "rm-ro", {}, false}).front();
  const advise::PhaseEvaluator evaluator_{candidate_, objective_};
  const advise::FirstTimestamps start_ = {0ms, 15ms, 58ms, 0ms, 0ms};  // R comes right before P
};

TEST_F(SearchOfGraph, GuaranteesNoMoreThanTheBestPhasesOfAGrid) {
  const advise::FoundPhases found = searched(1);
  double best = std::numeric_limits<double>::infinity();
  advise::FirstTimestamps first(candidate_.tasks.set.size());
  for (int q = 0; q < 40; q += 2) {
    for (int r = 0; r < 20; r += 2) {
      first[1] = std::chrono::milliseconds(q);
      first[2] = std::chrono::milliseconds(r);
      best = std::min(best, evaluator_.at(first).score.value);
    }
  }
  EXPECT_LE(found.score.value, best);
  EXPECT_LT(found.score.value, evaluator_.at(start_).score.value);
}

TEST_F(SearchOfGraph, DependsNeitherOnThreadsNorOnChance) {
  const advise::FoundPhases one = searched(1), two = searched(2);
  EXPECT_EQ(one.first, two.first);
  EXPECT_EQ(one.evaluations, two.evaluations);
}

TEST(GuaranteedObjectives, AreWorstCasesOfChainsThatBeginInTimersAndLateness) {
  const Graph graph = load_graph(find_graph("autoware"));
  const auto error_of = [&](const char* text) {
    try {
      advise::check_guaranteed(advise::parse_objective(text, graph), graph);
    } catch (const program::UsageError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  for (const char* text : {"hot_path:worst", "hot_path:age", "hot_path<80", "worst_lateness"}) {
    EXPECT_EQ(error_of(text), "accepted") << text;
  }
  EXPECT_THAT(error_of("hot_path:p99"), HasSubstr("CHAIN:worst"));
  EXPECT_THAT(error_of("hot_path:median"), HasSubstr("CHAIN:age"));
  EXPECT_THAT(error_of("losses"), HasSubstr("worst_lateness"));
}

TEST(Evaluator, RefusesByNameWhatTheExactWorstCasesDoNotCover) {
  Graph graph = load_graph(find_graph("autoware"));
  graph.platform.cores = 2;
  const advise::Objective objective = advise::parse_objective("hot_path:worst", graph);
  advise::CandidateOptions options{{"multi:2"}, {"isolated"}, "multi:2", {}, false};
  const std::vector<advise::Candidate> candidates = advise::make_candidates(graph, objective, options);
  ASSERT_EQ(candidates.size(), 2U);
  const advise::FirstTimestamps first(candidates[0].tasks.set.size());
  EXPECT_THAT(advise::PhaseEvaluator(candidates[0], objective).at(first).refusal,
              HasSubstr("several threads"));
  EXPECT_THAT(advise::PhaseEvaluator(candidates[1], objective).at(first).refusal, HasSubstr("deployment"));
}

}  // namespace
}  // namespace hotpath
