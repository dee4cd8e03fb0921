// SPDX-License-Identifier: Apache-2.0
// Objectives, candidates, and predictions that depend only on the seed.
#include <gmock/gmock.h>

#include <filesystem>
#include <map>

#include "advise/candidates.hpp"
#include "advise/executor_file.hpp"
#include "advise/prediction.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

Graph graph_named(const std::string& name, unsigned cores = 1) {
  Graph graph = load_graph(find_graph(name));
  graph.platform.cores = cores;
  return graph;
}

std::string error_of(const std::string& objective, const Graph& graph) {
  try {
    (void)advise::parse_objective(objective, graph);
  } catch (const program::UsageError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Objectives, AreReadAndRefusedWithWhatWouldBeRight) {
  const Graph graph = graph_named("sequences");
  EXPECT_EQ(advise::parse_objective("hot_path:median", graph).text, "median of localization");
  EXPECT_EQ(advise::parse_objective("lane_detection:worst", graph).chain, 1U);
  const advise::Objective both = advise::parse_objective("localization<90,lane_detection<50.5", graph);
  ASSERT_EQ(both.requirements.size(), 2U);
  EXPECT_EQ(both.requirements[1].most_ms, 50.5);
  EXPECT_EQ(advise::parse_objective("losses", graph).kind, advise::Objective::Kind::losses);
  EXPECT_THAT(error_of("nonsense:p99", graph), HasSubstr("it has localization, lane_detection"));
  EXPECT_THAT(error_of("hot_path:p98", graph), HasSubstr("hot_path:median"));
  EXPECT_THAT(error_of("localization<x", graph), HasSubstr("CHAIN<MS"));
  EXPECT_THAT(error_of("localization<0", graph), HasSubstr("CHAIN<MS"));
  EXPECT_THAT(error_of("", graph), HasSubstr("CHAIN<MS"));
  EXPECT_THAT(error_of("hot_path:p99", graph_named("timers_only_60")), HasSubstr("worst_lateness"));
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
}

std::vector<std::string> names_of(const std::vector<advise::Candidate>& candidates) {
  std::vector<std::string> names;
  names.reserve(candidates.size());
  for (const advise::Candidate& c : candidates) names.push_back(c.name);
  return names;
}

std::vector<advise::Candidate> candidates_of(const Graph& graph) {
  advise::CandidateOptions options;
  options.now = "default";
  options.scheduling.workers = 2;
  return advise::make_candidates(
      graph, graph.chains.empty() ? advise::Objective{} : advise::parse_objective("hot_path:p99", graph),
      options);
}

TEST(Candidates, FollowFromTraitsGraphAndCores) {
  const std::vector<std::string> one = names_of(candidates_of(graph_named("sequences")));
  EXPECT_THAT(one, Contains("rm-ro"));
  EXPECT_THAT(one, Contains("cbg:1"));
  EXPECT_THAT(one, Not(Contains("multi:1"))) << "one thread of it is default";
  EXPECT_THAT(one, Not(Contains("fp-ro"))) << "nobody gives priorities";
  EXPECT_THAT(one, Not(Contains("dm-ro"))) << "deadlines are periods";
  EXPECT_THAT(one, Contains("fp-ro:chain"));
  EXPECT_THAT(one, Not(Contains("chain-first"))) << "no second core";
  const std::vector<std::string> two = names_of(candidates_of(graph_named("autoware", 2)));
  for (const char* name : {"multi:2", "cbg:2", "fp-ro", "chain-first", "cie:chain", "isolated"}) {
    EXPECT_THAT(two, Contains(name));
  }
  EXPECT_THAT(names_of(candidates_of(graph_named("timers_only_60"))), Not(Contains("fp-ro:chain")));
}

TEST(Candidates, PutTheTimersOfTheChainFirst) {
  for (const advise::Candidate& c : candidates_of(graph_named("autoware"))) {
    if (c.name != "fp-ro:chain") continue;
    EXPECT_EQ(c.graph.find("FrontLidarDriver")->priority, 1);
    EXPECT_EQ(c.graph.find("RearLidarDriver")->priority, 1);
    EXPECT_GT(c.graph.find("EuclideanClusterSettings")->priority, 1);
    EXPECT_GT(c.graph.find("PointCloudMap")->priority, c.graph.find("Visualizer")->priority);
    return;
  }
  FAIL() << "not among the candidates";
}

/// PriorityExecutor has a service wait by default, a graph has not.
TEST(ExecutorFiles, HaveTheServiceWaitOfThePrediction) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "hotpath_executor_file";
  std::filesystem::create_directories(folder);
  for (advise::Candidate& c : candidates_of(graph_named("autoware"))) {
    if (c.name != "rm-ro" && c.name != "events-ro") continue;
    for (const auto& [wait, line] : std::map<Duration, std::string>{{0ms, "service_wait_ms: 0\n"},
                                                                    {5ms, "service_wait_ms: 5\n"},
                                                                    {2500us, "service_wait_ms: 2.5\n"}}) {
      c.spec.scheduler.guaranteed_wait = wait;
      ASSERT_FALSE(advise::write_executor_files(c, c.graph.platform, "", folder).empty());
      const std::string text = read_text_file((folder / "executor.yaml").string());
      if (c.name == "rm-ro")
        EXPECT_THAT(text, HasSubstr(line));
      else
        EXPECT_THAT(text, Not(HasSubstr("service_wait_ms")));
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(Candidates, SayWhoseThreadHasTooMuchToDo) {
  Graph graph = graph_named("autoware", 2);
  scale_to_load(graph, 130);
  std::map<std::string, std::string> overload;
  for (const advise::Candidate& c : candidates_of(graph)) overload[c.name] = c.overload;
  EXPECT_THAT(overload.at("default"), HasSubstr("130 % of one core of work for 1 thread"));
  EXPECT_EQ(overload.at("multi:2"), "");
  EXPECT_EQ(overload.at("rm-threads"), "");
}

TEST(Predictions, DependOnTheSeedAndNotOnThreads) {
  const Graph graph = graph_named("autoware", 2);
  const std::vector<advise::Candidate> candidates = candidates_of(graph);
  advise::PredictionOptions options;
  options.common.phases = Phases::random;
  options.common.duration_s = 2;
  options.common.warm_up_s = 0.5;
  options.draws = 2;
  options.budget = std::chrono::hours(1);
  const auto medians = [&](unsigned threads, std::uint64_t seed) {
    options.threads = threads;
    options.common.seed = seed;
    std::vector<double> all;
    for (const advise::Prediction& p : advise::predict(candidates, options, [](std::uint32_t) {})) {
      all.push_back(p.summary.chains.at(0).hot_path.quantiles.p50);
    }
    return all;
  };
  EXPECT_EQ(medians(1, 1), medians(3, 1));
  EXPECT_NE(medians(1, 1), medians(1, 2));
}

TEST(Predictions, StopAfterTheDrawInWhichTheBudgetEnds) {
  const Graph graph = graph_named("sequences");
  const std::vector<advise::Candidate> candidates = candidates_of(graph);
  advise::PredictionOptions options;
  options.common.duration_s = 1;
  options.draws = 5;
  std::uint32_t told = 0;
  const auto predictions = advise::predict(candidates, options, [&](std::uint32_t draws) { told = draws; });
  EXPECT_EQ(told, 1U);
  EXPECT_FALSE(predictions.empty());
  for (const advise::Prediction& p : predictions) EXPECT_EQ(p.draws.size(), 1U);
}

}  // namespace
}  // namespace hotpath
