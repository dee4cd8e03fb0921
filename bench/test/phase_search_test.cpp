// SPDX-License-Identifier: Apache-2.0
// The search of phases against functions whose best phases are known, and against all phases of a grid.
#include "advise/phase_search.hpp"

#include <gmock/gmock.h>

#include "reference_nodes.hpp"

namespace hotpath::phase_search_test {

using namespace std::chrono_literals;

TaskSet timers(const std::vector<Duration>& periods) {
  TaskSet set;
  for (const Duration period : periods) {
    Task& task = set.tasks.emplace_back();
    task.name = "T" + std::to_string(set.tasks.size());
    task.period = task.deadline = period;
  }
  return set;
}

advise::PhaseValues scored(const advise::FirstTimestamps& first, double value) {
  return {.first = first, .refusal = std::nullopt, .within_margin = {value, 0, 0}};
}

double score_of(const advise::PhaseValues& found) { return found.within_margin.value; }

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
  const auto score = [&](const advise::FirstTimestamps& first, const advise::Score&) {
    const Duration second = (first[1] - first[0] + 100ms) % 100ms,
                   third = (first[2] - first[0] + 100ms) % 50ms;
    return scored(first, outside(second, 30ms, 50ms) + outside(third, 10ms, 20ms));
  };
  const advise::PhaseValues found = advise::search_phases(set, {}, {{0ms, 90ms, 3ms}}, score, 1);
  EXPECT_EQ(score_of(found), 0);
  EXPECT_TRUE(found.complete);
  EXPECT_NEAR(to_ms((found.first[1] - found.first[0] + 100ms) % 100ms), 40, 4);
  EXPECT_NEAR(to_ms((found.first[2] - found.first[0] + 100ms) % 50ms), 15, 2);
}

TEST(PhaseSearch, MovesTimersTogetherWhereOneAloneWouldBeWorse) {
  const TaskSet set = timers({100ms, 100ms, 100ms});
  const auto score = [&](const advise::FirstTimestamps& first, const advise::Score&) {
    const double apart = to_ms(std::chrono::abs(first[1] - first[2]));
    const double away = to_ms(std::chrono::abs((first[1] - first[0] + 100ms) % 100ms - 50ms));
    return scored(first, 100 * apart + away);
  };
  EXPECT_GT(score_of(advise::search_phases(set, {}, {{0ms, 0ms, 0ms}}, score, 1)), 40);
  EXPECT_LT(score_of(advise::search_phases(set, {1, 2}, {{0ms, 0ms, 0ms}}, score, 1)), 1);
}

TEST(PhaseSearch, TakesNoPhasesWhoseScoreIsOnlyKnownToBeGreater) {
  const TaskSet set = timers({100ms, 100ms});
  const auto whole = [](const advise::FirstTimestamps& first) {
    return to_ms((first[1] - first[0] + 130ms) % 100ms);  // least 30 ms before the first timer
  };
  const auto early = [&](const advise::FirstTimestamps& first, const advise::Score& enough) {
    return scored(first, whole(first) > enough.value ? std::nextafter(enough.value, 1000.0) : whole(first));
  };
  const advise::PhaseValues found =
      advise::search_phases(set, {}, {{0ms, 69ms}, {0ms, 20ms}, {0ms, 45ms}}, early, 1);
  EXPECT_EQ(score_of(found), whole(found.first));
  EXPECT_LT(score_of(found), 1);
}

TEST(PhaseSearch, KeepsTheBestWhenItIsStopped) {
  const TaskSet set = timers({100ms, 100ms});
  const auto score = [](const advise::FirstTimestamps& first, const advise::Score&) {
    return scored(first, to_ms((first[1] - first[0] + 100ms) % 100ms));
  };
  int asked = 0;
  const advise::PhaseValues found =
      advise::search_phases(set, {}, {{0ms, 60ms}, {0ms, 50ms}}, score, 1, [&] { return ++asked > 2; });
  EXPECT_FALSE(found.complete);
  EXPECT_LT(score_of(found), 60);
  EXPECT_EQ(score_of(found), score(found.first, {}).within_margin.value);
  EXPECT_FALSE(advise::search_phases(set, {}, {{0ms, 60ms}}, score, 1, [] { return true; }).exact());
}

/// Two sensors whose data meet in a join, and a third one beside them.
class SearchOfGraph : public testing::Test {
 protected:
  static Graph three_sensors() {
    Graph graph;
    for (ReferenceNode node :
         {reference_node("P", NodeType::sensor, {}, 40ms, 6ms),
          reference_node("Q", NodeType::sensor, {}, 40ms, 6ms),
          reference_node("R", NodeType::sensor, {}, 60ms, 6ms),
          reference_node("F", NodeType::fusion, {{"P", 1, {}}, {"Q", 1, {}}}, {}, 6ms)}) {
      node.best_case_execution_time = 2ms;
      graph.nodes.push_back(node);
    }
    graph.chains = {{"c", {"P", "Q", "F"}, {"P", "Q"}, "F"}};
    return graph;
  }
  static advise::Options rm_ro() {
    advise::Options options;
    options.executors = {"rm-ro"};
    options.choose_phases = true;
    return options;
  }
  advise::PhaseValues values_at(const advise::FirstTimestamps& first) const {
    return advise::exact_values(candidate_, objective_, first);
  }
  advise::PhaseValues searched(unsigned thread_count) const {
    const auto score = [&](const advise::FirstTimestamps& first, const advise::Score&) {
      return values_at(first);
    };
    return advise::search_phases(candidate_.tasks.set, {0, 1}, {start_}, score, thread_count);
  }

  const Graph graph_ = three_sensors();
  const advise::Objective objective_ = advise::parse_objective("c:age:worst", graph_);
  const advise::Candidate candidate_ = advise::make_candidates(graph_, objective_, rm_ro()).front();
  const advise::FirstTimestamps start_ = {0ms, 15ms, 58ms, 0ms, 0ms};  // R comes right before P
};

TEST_F(SearchOfGraph, GuaranteesNoMoreThanTheBestPhasesOfAGridAndDependsNotOnThreads) {
  const advise::PhaseValues one = searched(1), two = searched(2);
  EXPECT_EQ(one.first, two.first);
  double best = INFINITY;
  advise::FirstTimestamps first(candidate_.tasks.set.size());
  for (int q = 0; q < 40; q += 2) {
    for (int r = 0; r < 20; r += 2) {
      first[1] = std::chrono::milliseconds(q);
      first[2] = std::chrono::milliseconds(r);
      best = std::min(best, values_at(first).score.value);
    }
  }
  EXPECT_LE(score_of(one), best);
  EXPECT_LT(score_of(one), values_at(start_).score.value);
}

}  // namespace hotpath::phase_search_test
