// SPDX-License-Identifier: Apache-2.0
// Terms by themselves, and incidents.
#include <gmock/gmock.h>

#include "watching.hpp"

namespace hotpath::watch {
namespace {

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
  Incidents incidents(std::chrono::hours(12));
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
  incident.add({Role::standstill, at_ms(40), "a thread stands"}, true);
  EXPECT_EQ(incident.text(), "00:00:00.040 a thread stands");
  EXPECT_THAT(incident.facts(), testing::ElementsAre("00:00:00.020 a bound", "00:00:00.020 a budget"));
  EXPECT_EQ(incident.breaches(), 4U);
  incident.add({Role::never_runs, at_ms(60), "a callback never runs"}, true);
  EXPECT_EQ(incident.text(), "00:00:00.060 a callback never runs");
  incident.add({Role::gone, at_ms(70), "a process has ended"}, true);
  EXPECT_EQ(incident.text(), "00:00:00.070 a process has ended");
}

TEST_F(Watching, NamesTheMostSevereIncidentAndHidesNone) {
  for (int i = 1; i <= 30; ++i) {
    system.run(5000.0 * i, 3);
    until(5000.0 * i + 5);
  }
  observer.threads({facts()}, at_ms(200'000));
  for (int i = 0; i < 100; ++i)
    observer.judge().incidents().add({Role::standstill, at_ms(200'000), "stands"});
  for (int i = 0; i < 30; ++i)
    observer.judge().all(Kind::thread)[0].compare(Clause::wait, 9'000'000, at_ms(200'001));
  EXPECT_EQ(incident(), "00:03:20.000 stands");
  EXPECT_THAT(incidents().back().facts(),
              testing::Contains(testing::HasSubstr("main waited for a processor for 9.000 ms")));
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
  EXPECT_EQ(incidents.kept().front().first().since, at_ms(13)) << "7 ms before";
}

TEST_F(Watching, KeepsIncidentsApart) {
  for (int i = 1; i <= 700; ++i) system.run(10 * i, i == 100 || i == 600 ? 3 : 1);
  until(7005);
  ASSERT_EQ(incidents().size(), 2U);
  const auto text = [&](std::size_t i) { return incidents()[i].text(); };
  EXPECT_EQ(text(0), "00:00:01.003 source (timer) ran 3.000 ms, budget 2.000 ms (measured)");
  EXPECT_EQ(text(1), "00:00:06.003 source (timer) ran 3.000 ms, budget 2.000 ms (measured)");
  EXPECT_EQ(observer.judge().json(false)["incidents"].size(), 2U);
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
  observer.describe(false);
  EXPECT_FALSE(incidents().back().is_described()) << "threads were not read";
  observer.threads({facts()}, at_ms(1));
  observer.threads({facts()}, at_ms(40));
  observer.describe(false);
  EXPECT_TRUE(incidents().back().is_described());
  EXPECT_EQ(incident(), "00:00:00.024 path took 4.500 ms, bound 4.000 ms (derived)");
  EXPECT_THAT(others(), testing::ElementsAre("00:00:00.023 source (timer) ran 1.000 ms",
                                             "00:00:00.024 path took 4.500 ms, requirement 3.500 ms (given)",
                                             "00:00:00.024 space.sink/a ran 1.000 ms"));
}

}  // namespace
}  // namespace hotpath::watch
