// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "watching.hpp"

namespace hotpath::watch {
namespace {

using testing::HasSubstr;
using K = tracing::EventKind;

TEST_F(Watching, MeasuresChains) {
  for (int i = 1; i <= 5; ++i) system.run(10 * i, i == 3 ? 1.5 : 1);
  until(60);
  ASSERT_EQ(check.chains().size(), 1U);
  EXPECT_EQ(check.chains()[0].hot_path.count(), 5U);
  EXPECT_EQ(check.chains()[0].hot_path.max(), from_ms(1.5));
  EXPECT_EQ(check.chains()[0].age.max(), from_ms(2.5));
  check.threads({facts()}, at_ms(1));
  check.threads({facts()}, at_ms(61));
  const std::vector<std::pair<std::string, std::string>> terms = {{"path", "hot_path_ms"},
                                                                  {"path", "age_ms"},
                                                                  {"path", "requirement_ms"},
                                                                  {"main", "policy"},
                                                                  {"main", "processors"},
                                                                  {"main", "wait_ms"},
                                                                  {"main", "serves"},
                                                                  {"a", "publishers"},
                                                                  {"source (timer)", "publishes"},
                                                                  {"source (timer)", "maximum_distance_ms"},
                                                                  {"space.sink/a", "publishes"},
                                                                  {"space.sink/a", "lost"},
                                                                  {"space.sink/a", "minimum_distance_ms"}};
  for (const auto& [of, term] : terms) EXPECT_EQ(verdict(of, term), "held") << of << " " << term;
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, FindsTheSystemInAnotherNamespace) {
  system.events[0].text[1] = "/robot1";
  system.events[1].text[0] = "/robot1/a";
  system.events[5].text[1] = "/robot1/space";
  system.events[6].text[0] = "/robot1/a";
  system.add(K::node_init, 5, {40, 41}, {"other", "/"});
  system.add(K::publisher_init, 5, {45, 40, 46, 1}, {"/a", ""});  // another topic
  system.run(10, 1);
  until(20);
  EXPECT_EQ(check.chains()[0].hot_path.count(), 1U);
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, PrefersTheNamespaceInWhichMoreNodesRun) {
  const std::vector<tracing::Event> later = std::exchange(system.events, {});
  system.add(K::node_init, 0, {70, 71}, {"source", "/sim"});
  system.add(K::publisher_init, 0, {75, 70, 76, 1}, {"/sim/a", ""});
  system.add(K::callback_start, 0, {73});  // not of a node
  system.add(K::callback_end, 0, {73});
  system.events.insert(system.events.end(), later.begin(), later.end());
  observe();
  until(1);
  system.run(10, 1);
  until(20);
  EXPECT_EQ(check.chains()[0].hot_path.count(), 1U);
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, NamesTheOverrunBeforeALateChain) {
  system.run(10, 1);
  system.run(20, 3);
  until(40);
  EXPECT_EQ(incident(), "00:00:00.023 source (timer) ran 3.000 ms, budget 2.000 ms (measured)");
  EXPECT_THAT(others(),
              testing::ElementsAre("00:00:00.023 path took 3.000 ms, bound 2.500 ms (derived)",
                                   "00:00:00.024 path took 4.000 ms, requirement 3.500 ms (given)"));
  EXPECT_EQ(verdict("path", "hot_path_ms"), "broken");
  EXPECT_EQ(verdict("path", "age_ms"), "held");
  EXPECT_EQ(verdict("path", "requirement_ms"), "broken");
}

TEST_F(Watching, ListsTheJobsUntilAChainWasLate) {
  system.run(10, 1);
  system.run(22.5, 1);  // 2.5 ms late
  until(30);
  check.describe(false);
  EXPECT_FALSE(check.judge().incidents().kept().back().is_described()) << "threads were not read";
  check.threads({facts()}, at_ms(1));
  check.threads({facts()}, at_ms(40));
  check.describe(false);
  EXPECT_TRUE(check.judge().incidents().kept().back().is_described());
  EXPECT_EQ(incident(), "00:00:00.024 path took 4.500 ms, bound 4.000 ms (derived)");
  EXPECT_THAT(others(), testing::ElementsAre("00:00:00.023 source (timer) ran 1.000 ms",
                                             "00:00:00.024 path took 4.500 ms, requirement 3.500 ms (given)",
                                             "00:00:00.024 space.sink/a ran 1.000 ms"));
}

/// The service /plan of node /planner, and a subscription of another node.
class WatchingAService : public Watching {
 protected:
  WatchingAService()
      : Watching(R"(
callbacks:
- node: planner
  service: plan
  budget_ms: {value: 5, from: given}
  response_ms: {value: 6, from: derived}
  minimum_distance_ms: {value: 7, from: given}
  depth: {value: 3, from: given}
  lost: {value: 0, from: derived}
  publishes: []
threads:
- name: main
  callbacks: [planner/plan (service)]
)") {
    system.add(K::node_init, 0, {3, 5}, {"planner", "/"});
    system.add(K::service_init, 0, {30, 3}, {"/plan", ""});
    system.add(K::service_callback_added, 0, {30, 31});
    system.add(K::service_init, 0, {40, 3}, {"/planner/set_parameters", ""});
    system.add(K::service_callback_added, 0, {40, 41});
    system.add(K::executor_init, 0, {50}, {"rm-ro", ""});
  }
  void serve(double start_ms, double length_ms, std::uint64_t callback = 31) {
    system.add(K::callback_start, start_ms, {callback});
    system.add(K::callback_end, start_ms + length_ms, {callback});
  }
};

TEST_F(WatchingAService, HoldsWhatEventsTell) {
  for (int i = 1; i <= 3; ++i) serve(10 * i, 5);
  serve(40, 9, 41);  // parameters: not in the contract, and no extra callback either
  until(60);
  EXPECT_FALSE(check.judge().broken()) << incident();
  for (const char* term : {"budget_ms", "publishes"})
    EXPECT_EQ(verdict("planner/plan (service)", term), "held") << term;
  EXPECT_EQ(verdict("main", "serves"), "held");
  for (const char* term : {"response_ms", "minimum_distance_ms", "depth", "lost"})
    EXPECT_EQ(verdict("planner/plan (service)", term), "not observable") << term;
  EXPECT_LT(observer.callbacks().at(2).response.max(), Duration::zero()) << "none";
}

TEST_F(WatchingAService, NamesAServiceThatTheContractLacks) {
  serve(10, 5);
  system.add(K::service_init, 15, {60, 3}, {"/container/load_node", ""});
  system.add(K::service_callback_added, 15, {60, 61});
  serve(20, 500, 61);
  until(530);
  EXPECT_EQ(incident(),
            "00:00:00.020 main ran /planner /container/load_node (service), which the contract lacks");
}

TEST_F(WatchingAService, NamesAnOverrun) {
  serve(10, 6.1);
  until(30);
  EXPECT_EQ(incident(), "00:00:00.016 planner/plan (service) ran 6.100 ms, budget 5.000 ms (given)");
}

TEST_F(WatchingAService, ComparesItsResponseWithAnArrivalThatTheExecutorStates) {
  system.add(K::executor_job, 9, {50, 1, 8'000'000, 0});
  serve(10, 4.5);
  until(30);
  EXPECT_THAT(incident(), HasSubstr("planner/plan (service) responded after 6.500 ms, bound 6.000 ms"));
}

TEST_F(WatchingAService, IsNotTheSubscriptionToATopicOfThatName) {
  system.add(K::subscription_init, 0, {60, 3, 63, 2}, {"/plan", ""});
  system.add(K::rclcpp_subscription_init, 0, {60, 62});
  system.add(K::subscription_callback_added, 0, {62, 61});
  serve(10, 1);
  serve(20, 9, 61);
  until(40);
  EXPECT_EQ(verdict("planner/plan (service)", "budget_ms"), "held");
  EXPECT_THAT(incident(), HasSubstr("main ran /planner /plan, which the contract lacks"));
}

TEST_F(Watching, KeepsIncidentsApart) {
  for (int i = 1; i <= 700; ++i) system.run(10 * i, i == 100 || i == 600 ? 3 : 1);
  until(7005);
  ASSERT_EQ(check.judge().incidents().kept().size(), 2U);
  const auto text = [&](std::size_t i) { return check.judge().incidents().kept()[i].text(); };
  EXPECT_EQ(text(0), "00:00:01.003 source (timer) ran 3.000 ms, budget 2.000 ms (measured)");
  EXPECT_EQ(text(1), "00:00:06.003 source (timer) ran 3.000 ms, budget 2.000 ms (measured)");
  EXPECT_EQ(check.judge().json(false)["incidents"].size(), 2U);
}

TEST(ManyIncidents, AreCountedAndTheFirstIsKept) {
  Incidents incidents;
  for (int i = 0; i < 1000; ++i) incidents.add({Role::assumption, at_ms(5000.0 * i), std::to_string(i)});
  EXPECT_EQ(incidents.count(), 1000U);
  EXPECT_EQ(incidents.kept().size(), Incidents::kMost);
  EXPECT_EQ(incidents.kept().front().number(), 1U);
  EXPECT_EQ(incidents.kept().back().number(), 1000U);
}

TEST(AStateThatStaysBroken, BeginsOneIncident) {
  Incidents incidents;
  JudgedTerm depth({Clause::depth, 5}, "sink/a", incidents);
  for (int i = 0; i < 10; ++i) depth.compare(7, at_ms(5000.0 * i));
  EXPECT_EQ(incidents.count(), 1U);
  EXPECT_EQ(depth.broken(), 10U);
  depth.compare(8, at_ms(60'000));
  EXPECT_EQ(incidents.count(), 2U);
}

TEST(AnIncident, ShowsInstantsByTheClockOfItsBeginning) {
  setenv("TZ", "UTC", 1);
  tzset();
  Incidents incidents;
  incidents.set_realtime(std::chrono::hours(12));
  incidents.add({Role::assumption, at_ms(59'000), "one"});
  incidents.set_realtime(std::chrono::hours(9));  // somebody set it
  incidents.add({Role::assumption, at_ms(65'000), "two"});
  EXPECT_EQ(incidents.kept().front().text(), "12:00:59.000 one");
  EXPECT_EQ(incidents.kept().back().text(), "09:01:05.000 two");
}

TEST(AnIncident, BeginsWithAStandstillOrElseWithWhatBrokeFirst) {
  Incidents none;
  JudgedTerm bound({Clause::age, 5}, "path", none), budget({Clause::budget, 5}, "source", none);
  Incident incident(1, {});
  incident.add({Role::bound, at_ms(20), "a bound", &bound}, true);
  incident.describe({{Role::circumstance, at_ms(1), "a wait"}});
  EXPECT_EQ(incident.text(), "00:00:00.020 a bound");
  incident.add({Role::assumption, at_ms(20), "a budget", &budget}, true);
  incident.add({Role::assumption, at_ms(30), "the budget again", &budget}, true);
  EXPECT_EQ(incident.text(), "00:00:00.020 a budget");
  EXPECT_FALSE(incident.is_described()) << "the wait was before another breach";
  incident.add({Role::standstill, at_ms(40), "a process has ended"}, true);
  EXPECT_EQ(incident.text(), "00:00:00.040 a process has ended");
  EXPECT_THAT(incident.facts(), testing::ElementsAre("00:00:00.020 a bound", "00:00:00.020 a budget"));
  EXPECT_EQ(incident.breaches(), 4U);
}

TEST(DistancesOfSeveralSamples, HoldTogether) {
  Incidents incidents;
  JudgedTerm distance({.clause = Clause::minimum_distance, .limit = 7'000'000, .further = {17'000'000}},
                      "sink/a", incidents);
  // Published at 0, 15 (5 ms late), 20, 30 and 40 ms.
  distance.compare_distances({from_ms(15)}, at_ms(15));
  distance.compare_distances({from_ms(5), from_ms(20)}, at_ms(20));
  distance.compare_distances({from_ms(10), from_ms(15)}, at_ms(30));
  distance.compare_distances({from_ms(10), from_ms(20)}, at_ms(40));
  EXPECT_EQ(distance.broken(), 2U);
  EXPECT_EQ(distance.checked(), 4U);
  EXPECT_EQ(incidents.kept().front().first().at, at_ms(20));
}

TEST_F(Watching, NamesACallbackThatTheContractLacks) {
  system.add(K::node_init, 5, {40, 41}, {"extra", "/"});
  system.add(K::timer_init, 5, {42, 7'000'000});
  system.add(K::timer_callback_added, 5, {42, 43});
  system.add(K::timer_link_node, 5, {42, 40});
  system.run(10, 1);
  system.add(K::callback_start, 13, {43});
  system.add(K::callback_end, 14, {43});
  until(20);
  EXPECT_THAT(incident(), HasSubstr("main ran /extra (timer 7 ms), which the contract lacks"));
}

TEST_F(Watching, NamesASecondPublisher) {
  system.run(10, 1);
  system.add(K::node_init, 15, {40, 41}, {"extra", "/"});
  system.add(K::publisher_init, 15, {45, 40, 46, 1}, {"/a", ""});
  until(20);
  EXPECT_THAT(incident(), HasSubstr("a has a publisher of /extra, which the contract lacks"));
  EXPECT_EQ(verdict("a", "publishers"), "broken");
}

TEST_F(Watching, NamesASampleOfAnUnwatchedPublisher) {
  system.run(10, 1);
  system.add(K::rmw_take, 17, {23, 98, 12345, 1});
  system.add(K::callback_start, 17, {21});
  system.add(K::callback_end, 17.5, {21});
  until(20);
  EXPECT_EQ(verdict("a", "publishers"), "broken");
  EXPECT_THAT(incident(), HasSubstr("published by a node that is not watched"));
}

TEST_F(Watching, TakesASampleOfBeforeForNoStrangerAfterARestart) {
  system.run(10, 1);
  system.run(20, 1);
  system.add(K::node_init, 22, {50, 4}, {"sink", "/space"});
  system.add(K::subscription_init, 22, {60, 50, 63, 2}, {"/a", ""});
  system.add(K::rclcpp_subscription_init, 22, {60, 62});
  system.add(K::subscription_callback_added, 22, {62, 61});
  system.add(K::rmw_take, 23, {63, 98, 2, 1});  // latched
  system.add(K::callback_start, 23, {61});
  system.add(K::callback_end, 23.5, {61});
  for (int i = 3; i <= 6; ++i) {
    system.run(10 * i, 1, false);
    system.add(K::rmw_take, 10 * i + 1, {63, 98, system.stamp, 1});
    system.add(K::callback_start, 10 * i + 1, {61});
    system.add(K::callback_end, 10 * i + 2, {61});
  }
  until(70);
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, SeesABurst) {
  system.run(10, 1);
  system.run(12.5, 1);
  until(20);
  EXPECT_THAT(incident(),
              HasSubstr("space.sink/a got samples at a distance of 2.500 ms, minimum distance 7.000"));
}

TEST_F(Watching, SeesLostSamples) {
  for (int i = 1; i <= 4; ++i) system.run(10 * i, 1, i == 4);  // depth 2
  until(50);
  EXPECT_EQ(verdict("space.sink/a", "lost"), "broken");
  EXPECT_THAT(incident(), HasSubstr("space.sink/a lost samples: 1, bound 0 (derived)"));
}

TEST_F(Watching, TakesTheEndOfProgramsForNoLossOfSamples) {
  system.run(10, 1);
  observe();
  check.end();
  for (int i = 2; i <= 5; ++i) system.run(10 * i, 1, false);  // depth 2
  until(60);
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, LimitsTheSamplesOfSeveralActivations) {
  for (const double start : {10.0, 17.5, 25.5}) system.run(start, 1);
  until(30);
  EXPECT_THAT(check.judge().json(false).dump(), HasSubstr("got 3 samples within 15.500 ms, minimum distance 17.000 ms"));
}

TEST_F(Watching, SeesSilence) {
  system.run(10, 1);
  system.run(20, 1);
  until(40);
  EXPECT_FALSE(check.judge().broken()) << incident();
  until(1000);
  EXPECT_THAT(incident(),
              HasSubstr("00:00:00.033 source (timer) got nothing for 980.000 ms, maximum distance"));
  system.run(1010, 1);
  until(1020);
  EXPECT_EQ(verdict("source (timer)", "maximum_distance_ms"), "broken");
}

/// The sink's queue is long; its samples are at most 13 ms apart.
class WatchingASlowSink : public Watching {
 protected:
  WatchingASlowSink() : Watching(slow()) { system.events[6].number[3] = 100; }
  static std::string slow() {
    std::string contract = kContract;
    return contract.insert(contract.find("  lost:"), "  maximum_distance_ms: {value: 13, from: derived}\n");
  }
  void take(double ms, std::uint64_t stamp) {
    system.add(K::rmw_take, ms, {23, 98, stamp, 1});
    system.add(K::callback_start, ms, {21});
    system.add(K::callback_end, ms + 0.1, {21});
  }
  nlohmann::json distance() const {
    nlohmann::json found;
    const nlohmann::json stored = check.judge().json(false);
    for (const nlohmann::json& term : stored["terms"])
      if (term.value("callback", "") == "space.sink/a" && term["term"] == "maximum_distance_ms") found = term;
    return found;
  }
};

TEST_F(WatchingASlowSink, TakesUnreadSamplesForNoSilence) {
  system.run(10, 1);
  for (int i = 2; i <= 30; ++i) {
    system.run(10 * i, 1, false);
    until(10 * i + 2);
  }
  for (std::uint64_t i = 2; i <= 30; ++i) take(302 + static_cast<double>(i) / 5, i);
  until(310);
  EXPECT_EQ(distance()["verdict"], "held") << distance();
  EXPECT_EQ(distance()["checked"], 29);
}

TEST_F(WatchingASlowSink, SeesSilenceAfterUnreadSamples) {
  for (int i = 1; i <= 3; ++i) system.run(10 * i, 1, i == 1);
  system.add(K::callback_start, 40, {11});  // publishes late
  until(150);
  EXPECT_EQ(distance()["broken"], 1);
  take(160, 2);
  take(161, 3);
  system.add(K::rcl_publish, 170, {13, 99});
  system.add(K::rmw_publish, 170, {14, 99, 4});
  take(171, 4);
  until(180);
  EXPECT_EQ(distance()["broken"], 1);
  EXPECT_EQ(distance()["observed"], 139.0);
}

TEST_F(WatchingASlowSink, MeasuresNoDistanceFromAnOldSample) {
  for (int i = 1; i <= 5; ++i) system.run(10 * i, 1);
  take(52.5, 777);  // published 777 ns after the beginning
  system.run(60, 1);
  until(65);
  EXPECT_EQ(distance()["verdict"], "held") << distance();
}

TEST_F(Watching, SeesACallbackThatDoesNotEnd) {
  system.add(K::callback_start, 10, {11});
  until(2010);
  EXPECT_THAT(
      incident(),
      HasSubstr("00:00:00.012 source (timer) has run for 2000.000 ms without an end, budget 2.000 ms"));
  until(3010);
  const nlohmann::json stored = check.judge().json(false);
  EXPECT_EQ(stored["terms"][1]["term"], "budget_ms");
  EXPECT_EQ(stored["terms"][1]["broken"], 1) << "once for each job";
}

TEST_F(Watching, TakesABoundAtTheEndOfALongJobForItsConsequence) {
  system.add(K::callback_start, 10, {11});
  until(100);
  system.add(K::callback_end, 5010, {11});
  system.add(K::callback_start, 5010, {21});
  system.add(K::callback_end, 5013, {21});
  until(5100);
  EXPECT_EQ(check.judge().incidents().kept().size(), 1U) << check.judge().json(false)["incidents"];
  EXPECT_EQ(check.judge().incidents().kept().front().breaches(), 3U) << "the budgets of both, and silence";
  EXPECT_THAT(incident(), HasSubstr("00:00:00.012 source (timer) ran 5000.000 ms"));
}

TEST_F(Watching, KeepsTheLengthsOfJobsThatAreOverdueTogetherApart) {
  const auto of_thread_8 = [&](K kind, double ms) {
    system.add(kind, ms, {11});
    system.events.back().thread = 8;
  };
  system.add(K::callback_start, 10, {11});
  until(110);
  of_thread_8(K::callback_start, 120);
  until(1110);
  of_thread_8(K::callback_end, 1111);  // it has displaced the other one for 991 ms
  system.add(K::callback_end, 1115, {11});
  until(1220);
  EXPECT_THAT(incident(), HasSubstr("00:00:00.012 source (timer) ran 114.000 ms"));
}

TEST_F(Watching, CountsNoTimeInWhichAnotherJobHadTheProcessor) {
  system.add(K::callback_start, 10, {11});
  for (const auto& [kind, ms] : {std::pair(K::callback_start, 11.0), std::pair(K::callback_end, 11.9)}) {
    system.add(kind, ms, {21});
    system.events.back().thread = 8;
  }
  system.add(K::callback_end, 12.5, {11});
  until(20);
  EXPECT_EQ(verdict("source (timer)", "budget_ms"), "held");
  EXPECT_EQ(verdict("space.sink/a", "budget_ms"), "held");
}

TEST_F(Watching, ConcludesNothingFromLostEvents) {
  system.run(10, 1);
  losses.dropped = 1;
  until(5000);
  system.run(6000, 1);
  until(6010);
  EXPECT_FALSE(check.judge().broken()) << incident();
  for (int i = 601; i <= 1400; ++i) system.run(10 * i, 1);
  until(14'010);
  EXPECT_FALSE(check.judge().broken()) << incident();
  until(15'000);
  EXPECT_THAT(incident(), HasSubstr("got nothing for")) << "it goes on after some seconds";
}

TEST_F(Watching, ConcludesNothingFromEventsThatCameWithTheLoss) {
  system.run(10, 1);
  until(20);
  observer.note_losses(1, at_ms(60));
  for (int i = 4; i <= 7; ++i) system.run(10 * i, 1, false);  // the takes were lost, and a job at 20 ms
  observe();
  losses.dropped = 1;
  until(80);
  EXPECT_FALSE(check.judge().broken()) << incident();
}

TEST_F(Watching, ExtendsNoSilenceThatEndedWhileEventsWereLost) {
  system.run(10, 1);
  until(45);
  losses.dropped = 1;
  until(1000);
  system.run(1010, 1);
  until(1200);
  EXPECT_THAT(incident(), HasSubstr("source (timer) got nothing for 35.000 ms"));
}

TEST_F(Watching, BeginsWithAProcessThatIsGone) {
  system.run(10, 1);
  system.run(20, 3);
  until(30);
  EXPECT_THAT(incident(), HasSubstr("source (timer) ran 3.000 ms"));
  observer.forget({7, 0});
  until(1000);
  EXPECT_THAT(incident(), HasSubstr("source (timer) ran 3.000 ms")) << "the others may be about to end";
  until(2100);
  EXPECT_EQ(incident(), "00:00:00.024 the process of source (timer) has ended");
}

TEST_F(Watching, BeginsWithACallbackThatNeverRuns) {
  const auto run = [&](int first, int last) {
    for (int i = first; i <= last; ++i) {
      system.run(10 * i, 1, false);
      until(10 * i + 5);
    }
  };
  run(1, 1000);
  EXPECT_THAT(incident(), HasSubstr("space.sink/a lost samples"));
  run(1001, 1110);
  EXPECT_EQ(check.judge().incidents().kept().back().text(),
            "00:00:00.011 space.sink/a has never run, although it got samples");
}

TEST_F(Watching, KeepsItsContractForManyJobs) {
  for (int i = 1; i <= 20'000; ++i) {
    system.run(10.0 * i, 1 + (i % 7) / 10.0);
    until(10.0 * i + 5);
    system.events.clear();
    observed = 0;
  }
  EXPECT_FALSE(check.judge().broken()) << incident();
  EXPECT_EQ(check.chains()[0].hot_path.count(), 20'000U);
}

}  // namespace
}  // namespace hotpath::watch
