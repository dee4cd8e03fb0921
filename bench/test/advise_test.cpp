// SPDX-License-Identifier: Apache-2.0
// Objectives, candidates, and the files of the recommended one.
#include <gmock/gmock.h>

#include <fstream>
#include <map>

#include "advise/advice_report.hpp"
#include "advise/candidates.hpp"
#include "advise/prediction.hpp"
#include "graph_fixture.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"

namespace hotpath::advise_test {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

Graph graph_named(const std::string& name, unsigned cores = 1) {
  Graph graph = load_graph(find_graph(name));
  graph.platform.cores = cores;
  return graph;
}

TEST(Objectives, AreReadAndRefusedWithWhatWouldBeRight) {
  using advise::parse_objective;
  const Graph graph = graph_named("sequences");
  for (const auto& [words, text] : std::map<std::string, std::string>{
           {"hot_path:median", "hot-path latency of localization (median)"},
           {"hot_path:age", "age of the data of localization (p99)"},
           {"lane_detection:age:worst", "age of the data of lane_detection (worst)"}})
    EXPECT_EQ(parse_objective(words, graph).text, text);
  EXPECT_EQ(parse_objective("lane_detection:worst", graph).chain, 1U);
  EXPECT_EQ(parse_objective(std::nullopt, graph).text, parse_objective("hot_path:age", graph).text);
  EXPECT_EQ(parse_objective("hot_path:age", graph).note,
            "--for: the graph has no chain hot_path; its first chain is meant, localization");
  const advise::Objective both = parse_objective("localization<90,lane_detection<50.5", graph);
  ASSERT_EQ(both.requirements.size(), 2U);
  EXPECT_EQ(both.requirements[1].most_ms, 50.5);
  for (const char* text : {"hot_path:worst", "hot_path:age:worst", "hot_path<80", "worst_lateness"})
    EXPECT_TRUE(parse_objective(text, graph).of_worst_cases()) << text;
  for (const char* text : {"hot_path:age", "hot_path:p99", "hot_path:median", "losses"})
    EXPECT_FALSE(parse_objective(text, graph).of_worst_cases()) << text;
  EXPECT_TRUE(parse_objective("hot_path:age", graph, results::kWorst).of_worst_cases());
  for (const auto& [words, remedy] :
       std::map<std::string, std::string>{{"nonsense:p99", "it has localization, lane_detection"},
                                          {"hot_path:p98", "CHAIN:age:median"},
                                          {"hot_path:age:", "CHAIN:age:median"},
                                          {"localization<x", "CHAIN<MS"},
                                          {"localization<0", "CHAIN<MS"},
                                          {"", "CHAIN<MS"}}) {
    EXPECT_THAT([&] { (void)parse_objective(words, graph); },
                testing::ThrowsMessage<program::UsageError>(HasSubstr(remedy)));
  }
  EXPECT_THAT([] { (void)parse_objective("hot_path:p99", graph_named("timers_only_60")); },
              testing::ThrowsMessage<program::UsageError>(HasSubstr("worst_lateness")));
}

TEST(Recommendations, AreRefusedToWhatStarvesATask) {
  advise::Prediction now, slow;
  results::TaskSummary& task = slow.summary.tasks.emplace_back();
  task.account.add({.job = {.skipped = 19}});
  EXPECT_EQ(advise::refusal(slow, now), "a task starves");
  task.account = {};
  task.account.add({.outcome = Outcome::skipped});
  EXPECT_EQ(advise::refusal(slow, now), "a task never runs");
}

TEST(Scores, AreOfTheAgeUnlessTheHotPathIsNamed) {
  const Graph graph = graph_named("sequences");
  results::ExecutorSummary summary;
  summary.chains.resize(2);
  summary.chains[0].end_to_end.quantiles.p99 = 7;
  summary.chains[0].hot_path.quantiles.p99 = 5;
  EXPECT_EQ(advise::score(advise::parse_objective("hot_path:age", graph), summary).value, 7);
  EXPECT_EQ(advise::score(advise::parse_objective("hot_path:p99", graph), summary).value, 5);
}

TEST(Scores, PreferWhatKeepsARequirementAndThenWhatHasMoreToSpare) {
  advise::Objective objective;
  objective.kind = advise::Objective::Kind::requirements;
  objective.requirements = {{0, 100}};
  const auto of = [&](double worst) {
    results::ExecutorSummary summary;
    summary.chains.emplace_back().end_to_end.quantiles.max = worst;
    return advise::score(objective, summary);
  };
  EXPECT_LT(of(40), of(90));
  EXPECT_LT(of(90), of(110));
  EXPECT_LT(of(110), of(120));
  EXPECT_NEAR(of(110).value, 10, 1e-9);
  EXPECT_LT(of(120), of(kNoValue)) << "no sample at all";
  objective.requirements.push_back({0, 50});
  EXPECT_NEAR(of(110).value, 10 + 120, 1e-9);
}

TEST(Scores, CountLossesOfAllJobsAndTimersThatNeverRanAsLate) {
  results::ExecutorSummary summary;
  summary.executed = 3;
  summary.skipped = 1;
  EXPECT_EQ(advise::score({.kind = advise::Objective::Kind::losses}, summary).value, 25);
  summary.tasks.emplace_back().account.count[static_cast<std::size_t>(Outcome::skipped)] = 1;
  EXPECT_EQ(advise::score({.kind = advise::Objective::Kind::worst_lateness}, summary).value, INFINITY);
}

/// The candidates by name.
std::map<std::string, advise::Candidate> candidates_of(const Graph& graph,
                                                       const std::string& now = "default") {
  std::map<std::string, advise::Candidate> candidates;
  const advise::Objective objective = advise::parse_objective(std::nullopt, graph);
  advise::Options options;
  options.now = now;
  for (advise::Candidate& c : advise::make_candidates(graph, objective, options))
    candidates.emplace(c.name, std::move(c));
  return candidates;
}

TEST(Candidates, FollowFromTraitsGraphAndCores) {
  const auto one = candidates_of(graph_named("sequences"));
  for (const char* name : {"rm-ro", "cbg:1", "fp-ro:chain"}) EXPECT_TRUE(one.contains(name)) << name;
  EXPECT_FALSE(one.contains("multi:1")) << "one thread of it is default";
  EXPECT_FALSE(one.contains("fp-ro")) << "nobody gives priorities";
  EXPECT_FALSE(one.contains("dm-ro")) << "deadlines are periods";
  EXPECT_FALSE(one.contains("chain-first")) << "no second core";
  const auto two = candidates_of(graph_named("autoware", 2));
  for (const char* name : {"multi:2", "cbg:2", "fp-ro", "chain-first", "cie:chain", "isolated"})
    EXPECT_TRUE(two.contains(name)) << name;
  std::set<int> priorities;  // rise along the chain
  for (const DeployedExecutor& e : two.at("cie:chain").spec.plan.executors)
    EXPECT_TRUE(e.policy.ordinary() || priorities.insert(e.policy.priority).second) << e.name;
  EXPECT_FALSE(candidates_of(graph_named("timers_only_60")).contains("fp-ro:chain"));
}

TEST(Candidates, PutTheTimersOfTheChainFirst) {
  const advise::Candidate c = candidates_of(graph_named("autoware")).at("fp-ro:chain");
  const auto priority = [&](const char* node) { return c.graph.find(node)->callbacks.back().priority; };
  EXPECT_EQ(priority("FrontLidarDriver"), 1);
  EXPECT_EQ(priority("RearLidarDriver"), 1);
  EXPECT_GT(priority("EuclideanClusterSettings"), 1);
  EXPECT_GT(priority("PointCloudMap"), priority("Visualizer"));
}

TEST(Candidates, LeaveNodesInTheirProcesses) {
  const Folder removed;
  const std::string file = (removed.path() / "two.yaml").string();
  std::ofstream(file) << "name: two\nexecutors:\n- {name: a, process: p, owns: [FrontLidarDriver]}\n"
                         "- {name: b, process: q, owns: rest}\n";
  const auto candidates = candidates_of(graph_named("autoware", 2), file);
  for (const char* name : {"two", "each:fp-ro:chain", "each:rm-ro"}) EXPECT_TRUE(candidates.contains(name));
  for (const char* name : {"rm-ro", "fp-ro:chain", "chain-first"}) EXPECT_FALSE(candidates.contains(name));
  const advise::Candidate& c = candidates.at("each:rm-ro");
  EXPECT_EQ(c.spec.plan.executors[1].process, 1U);
  ASSERT_FALSE(advise::write_executor_files(c, c.graph.platform, "", removed.path()).empty());
  EXPECT_THAT(read_text_file((removed.path() / "executor.yaml").string()),
              HasSubstr("executor: rm-ro\nthreads: 1\n"));
}

/// PriorityExecutor has a service wait by default, a graph has not.
TEST(ExecutorFiles, HaveTheServiceWaitOfThePrediction) {
  const Folder removed;
  const std::filesystem::path folder = removed.path();
  auto candidates = candidates_of(graph_named("autoware"));
  for (const char* name : {"rm-ro", "events-ro"}) {
    advise::Candidate& c = candidates.at(name);
    for (const auto& [wait, line] : std::map<Duration, std::string>{{0ms, "service_wait_ms: 100\n"},
                                                                    {5ms, "service_wait_ms: 5\n"},
                                                                    {2500us, "service_wait_ms: 2.5\n"}}) {
      c.spec.scheduler.service_wait = wait;
      ASSERT_FALSE(advise::write_executor_files(c, c.graph.platform, "", folder).empty());
      EXPECT_THAT(read_text_file((folder / "executor.yaml").string()),
                  HasSubstr(c.name == "rm-ro" ? line : "threads: 1\ngraph: graph.yaml\n"));
    }
  }
  EXPECT_THAT(read_text_file((folder / "executor.yaml").string()), Not(HasSubstr("service_wait_ms")));
}

}  // namespace hotpath::advise_test
