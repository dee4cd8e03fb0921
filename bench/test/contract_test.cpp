// SPDX-License-Identifier: Apache-2.0
// Terms, incidents, and contracts as they are stated and read.
#include <gmock/gmock.h>

#include <map>
#include <string>
#include <vector>

#include "graph_fixture.hpp"
#include "program/text.hpp"
#include "setup/executor_spec.hpp"
#include "watch/contract.hpp"
#include "watching.hpp"

namespace hotpath::watch::contract_test {

using testing::HasSubstr;

/// The timer's jobs take at most 2 ms; samples are at least 8 ms apart.
constexpr const char* kChecked = R"(
callbacks:
- node: source
  budget_ms: {value: 2, from: measured}
  period_ms: {value: 10, from: given}
  response_ms: {value: 3, from: derived}
- node: space.sink
  topic: a
  depth: {value: 2, from: given}
  minimum_distance_ms: {value: 8, from: derived}
- node: elsewhere
  budget_ms: {value: 1, from: given}
)";

class Checking : public Watching {
 protected:
  Checking() : Watching(kChecked) {}
};

TEST_F(Checking, AllTermsHold) {
  for (int i = 1; i <= 5; ++i) system.run(10 * i, 2);
  observe();
  EXPECT_EQ(incident(), "");
  for (const char* term : {"budget_ms", "period_ms", "response_ms"})
    EXPECT_EQ(verdict("source (timer)", term), "held") << term;
  for (const char* term : {"depth", "minimum_distance_ms"})
    EXPECT_EQ(verdict("space.sink/a", term), "held") << term;
  EXPECT_EQ(verdict("elsewhere (timer)", "budget_ms"), "not observable");
}

TEST_F(Checking, SeesOtherPeriodsAndDepths) {
  system.events[2].number[1] = 9'000'000;
  system.events[6].number[3] = 3;
  system.run(9, 1);
  observe();
  EXPECT_EQ(verdict("source (timer)", "period_ms"), "broken");
  EXPECT_EQ(verdict("space.sink/a", "depth"), "broken");
  EXPECT_THAT(incident(), HasSubstr("has a period of 9.000 ms, period 10.000 ms (given)"));
}

TEST_F(Checking, CannotTellWhatHeldWithLostEvents) {
  system.run(10, 2);
  observe();
  EXPECT_EQ(verdict("source (timer)", "budget_ms", true), "not observable");
  system.run(20, 3);
  observe();
  EXPECT_EQ(verdict("source (timer)", "budget_ms", true), "broken");
}

TEST_F(Checking, JudgesNoJobWhoseEndMayBeLost) {
  losses = 1;
  system.add(tracing::EventKind::callback_start, 10, {11});
  until(20);
  until(7000);
  system.add(tracing::EventKind::callback_end, 7001, {11});  // of a later job, whose start was lost
  observe();
  EXPECT_EQ(incident(), "");
  system.add(tracing::EventKind::callback_start, 7010, {11});
  until(8000);
  EXPECT_THAT(incident(), HasSubstr("00:00:07.012 source (timer) has run for 990.000 ms"));
}

/// A second timer of the source, with the same period.
TEST_F(Checking, GivesATimerTheEntryOfOneThatItReplaces) {
  system.run(10, 1);
  system.create_timer(15, 80);
  system.job(25, 3, 81);
  observe();
  EXPECT_THAT(incident(), HasSubstr("00:00:00.028 source (timer) ran 3.000 ms, budget 2.000 ms"));
  // A contract of a recording numbers timers as the executor served them: periods decide.
  tracing::System created;
  created.nodes = {"/a"};
  Contract served;
  for (const std::uint32_t i : {1U, 2U}) {
    tracing::Callback& timer = created.callbacks.emplace_back();
    timer.kind = tracing::CallbackKind::timer;
    timer.node = 0;
    timer.period = Duration(10 * i);
    served.callbacks.push_back({"a", "", i, {{Clause::period, 30 - 10 * i}}});
  }
  StatedNames names(served, created);
  EXPECT_EQ(std::pair(names.entry_of(0), names.entry_of(1)), std::pair(1U, 0U));
}

TEST_F(Checking, GivesATimerNoEntryBesideOneThatGoesOn) {
  system.run(10, 1);
  system.create_timer(15, 80);
  system.run(20, 1);
  system.job(25, 3, 81);
  observe();
  EXPECT_EQ(incident(), "");
}

TEST(ManyIncidents, AreCountedAndTheFirstIsKept) {
  Incidents incidents;
  for (int i = 0; i < 1000; ++i) incidents.add({Role::assumption, at_ms(5000.0 * i), std::to_string(i)});
  EXPECT_EQ(incidents.count(), 1000U);
  EXPECT_EQ(incidents.kept.size(), Incidents::kMost);
  EXPECT_EQ(incidents.kept.front().number(), 1U);
  EXPECT_EQ(incidents.kept.back().number(), 1000U);
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
  Incidents incidents{std::chrono::hours(12)};
  incidents.add({Role::assumption, at_ms(59'000), "one"});
  incidents.realtime = std::chrono::hours(9);  // somebody set it
  incidents.add({Role::assumption, at_ms(65'000), "two"});
  EXPECT_EQ(incidents.kept.front().text(), "12:00:59.000 one");
  EXPECT_EQ(incidents.kept.back().text(), "09:01:05.000 two");
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
  EXPECT_EQ(incident.json()["breaches"], 4U);
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
  EXPECT_EQ(incidents.kept.front().first().at, at_ms(20));
  EXPECT_EQ(incidents.kept.front().first().since, at_ms(13)) << "7 ms before";
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

/// As it is read from its file.
Contract stated(const Graph& graph, const setup::ExecutorSpec& executor) {
  return parse_contract("a contract", contract_text(stated_contract(graph, make_tasks(graph), executor)));
}

TEST(StatedContract, HasAnEntryForAService) {
  const Graph graph = load(
      "name: robot\n"
      "nodes:\n"
      "- {name: caller, type: sensor, period_ms: 100, output: plan}\n"
      "- name: planner\n"
      "  type: callbacks\n"
      "  callbacks: [{subscription: plan, service: true, execution_time_ms: 5}]\n");
  const Contract contract = stated(graph, setup::parse_executor("rm-ro", {}));
  ASSERT_EQ(contract.callbacks.size(), 2U);
  const CallbackContract& service = contract.callbacks[1];
  EXPECT_EQ(service.name(), "planner/plan (service)");
  EXPECT_TRUE(service.service);
  EXPECT_EQ(service.terms.at(1).clause, Clause::budget);
  EXPECT_EQ(service.terms.at(1).limit, from_ms(5).count());
  EXPECT_EQ(contract.threads.at(0).callbacks, (std::vector<std::uint32_t>{0, 1}));
}

/// The terms of a reader with this work and depth, whose timer with a period of 10 ms waits for another one.
std::vector<Term> terms_of_reader(const char* executor, double work_ms, int depth, double jitter_ms = 0) {
  Graph graph = load(program::text(
      "name: g\nnodes:\n- {name: T, type: sensor, period_ms: 10, execution_time_ms: 2, output: t,"
      " release_jitter_ms: %g}\n"
      "- {name: L, type: sensor, period_ms: 50, execution_time_ms: 5}\n"
      "- {name: R, type: callbacks, callbacks: [{subscription: t, depth: %d, execution_time_ms: %g}]}\n",
      jitter_ms, depth, work_ms));
  graph.platform.release_cost = from_ms(0.1);
  graph.platform.time_slice = from_ms(5);
  return stated(graph, setup::parse_executor(executor, {})).callbacks.at(2).terms;
}

TEST(StatedContract, PromisesNoLossIfTheQueueHoldsWhatComesDuringAResponse) {
  EXPECT_NE(find(terms_of_reader("rm-ro", 2, 1), Clause::lost), nullptr);
  EXPECT_EQ(find(terms_of_reader("rm-ro", 5, 1), Clause::lost), nullptr);
  EXPECT_NE(find(terms_of_reader("rm-ro", 5, 2), Clause::lost), nullptr);
}

TEST(StatedContract, CountsInABudgetTheReleasesThatATimeSliceDelayed) {
  EXPECT_EQ(find(terms_of_reader("events-ro", 2, 1), Clause::budget)->limit, from_ms(2.2).count());
  EXPECT_EQ(find(terms_of_reader("events-ro", 5, 1), Clause::budget)->limit, from_ms(5.3).count());
  EXPECT_EQ(find(terms_of_reader("events-ro", 2, 1, 4), Clause::budget)->limit, from_ms(2.3).count())
      << "a late release and the next one on time";
}

/// `budget_ms` of the timer of each thread, in ms; 0: none. Behind it `wait` if its waits have a limit.
std::vector<std::string> budgets_and_waits(const std::string& threads, const std::string& platform) {
  const Graph graph = load("name: timers\nplatform: {cores: 2" + platform +
                           "}\nnodes:\n"
                           "- {name: a, type: sensor, period_ms: 100, execution_time_ms: 5}\n"
                           "- {name: b, type: sensor, period_ms: 100, execution_time_ms: 5}\n"
                           "- {name: c, type: sensor, period_ms: 100, execution_time_ms: 5}\n");
  const File deployment("threads.yaml", "name: threads\nexecutors:\n" + threads);
  const Contract contract =
      stated(graph, setup::deploy(find_deployment(deployment.path(), graph, make_tasks(graph)), {}));
  std::vector<std::string> all;
  for (std::size_t c = 0; c < 3; ++c) {
    const Term* const budget = find(contract.callbacks.at(c).terms, Clause::budget);
    all.push_back(program::fixed(budget ? to_ms(Duration(budget->limit)) : 0, 1));
    if (find(contract.threads.at(c).terms, Clause::wait)) all.back() += " wait";
  }
  return all;
}

TEST(StatedContract, LimitsWhatEventsTellOfThreads) {
  using testing::ElementsAre;
  const std::string real_time =
      "- {name: high, executor: default, policy: 'fifo:20', processors: [0], owns: [a]}\n"
      "- {name: low, executor: default, policy: 'fifo:10', processors: [0], owns: [b]}\n";
  const std::string last = "- {name: last, executor: default, owns: [c]", bound = ", processors: [0]}\n";
  EXPECT_THAT(budgets_and_waits(real_time + last + bound, ""), ElementsAre("5.0 wait", "5.0", "5.0"));
  EXPECT_THAT(budgets_and_waits(real_time + last + "}\n", ""), ElementsAre("5.0 wait", "5.0", "0.0"))
      << "events do not tell on which processor the last thread waits";
  EXPECT_THAT(budgets_and_waits(real_time + last + bound, ", dispatch_cost_us: 100"),
              ElementsAre("5.0 wait", "10.2", "0.0"))
      << "nor how long dispatching in the high thread displaces the others";
  const std::string equal =
      "- {name: one, executor: default, policy: 'fifo:20', processors: [0], owns: [a]}\n"
      "- {name: other, executor: default, policy: 'fifo:20', processors: [0], owns: [b]}\n";
  EXPECT_THAT(budgets_and_waits(equal + last + ", processors: [1]}\n", ""),
              ElementsAre("5.0", "5.0", "5.0 wait"));
  const std::string ordinary =
      "- {name: one, executor: default, owns: [a]}\n"
      "- {name: other, executor: default, owns: [b]}\n";
  EXPECT_THAT(budgets_and_waits(ordinary + last + "}\n", ""), ElementsAre("0.0", "0.0", "0.0"));
  EXPECT_THAT(budgets_and_waits(ordinary + last + ", policy: 'fifo:1', processors: [1]}\n", ""),
              ElementsAre("0.0", "0.0", "5.0 wait"));
}

TEST(ContractReading, RejectsWhatItDoesNotUnderstand) {
  const std::string node = "callbacks: [{node: a, publishes: []}]\n";
  const std::map<std::string, std::string> wrong = {
      {"callbacks: []", "callback"},
      {"callbacks: [{node: a}]", "promises nothing"},
      {"callbacks: [{topic: a}]", "node"},
      {"callbacks: [{node: a, budget_ms: 5}]", "budget_ms"},
      {"callbacks: [{node: a, budget_ms: {value: 5}}]", "from"},
      {"callbacks: [{node: a, budget_ms: {value: -5, from: given}}]", "budget_ms"},
      {"callbacks: [{node: a, budget_ms: {value: 5, from: hearsay}}]", "measured"},
      {"callbacks: [{node: a, depth: {value: 5, from: given}}]", "depth"},
      {"callbacks: [{node: a, topic: b, period_ms: {value: 5, from: given}}]", "period_ms"},
      {"callbacks: [{node: a, service: b, period_ms: {value: 5, from: given}}]", "period_ms"},
      {"callbacks: [{node: a, topic: b, service: b, publishes: []}]", "a topic and a service"},
      {"callbacks: [{node: a, unknown: 1}]", "unknown"},
      {"callbacks: [{node: a, publishes: [{topic: b, rule: always}]}]", "rule"},
      {"callbacks: [{node: a, topic: b, minimum_distance_ms: {value: [5, 4], from: given}}]", "ascend"},
      {node + "chains: [{name: c, sources: [b (timer)], sinks: [a (timer)]}]",
       "no callback is called `b (timer)`"},
      {node + "chains: [{name: c, sinks: [a (timer)]}]", "sources"},
      {node + "threads: [{name: c, callbacks: [a (timer)], policy: {value: soft, from: given}}]", "soft"},
      {node + "threads: [{name: c, callbacks: [a (timer)], processors: {value: [99], from: given}}]", "99"},
      {node + "threads: [{name: c, callbacks: [a (timer)], processors: {value: [1, 1], from: given}}]",
       "twice"},
      {"other: 1", "other"},
      {"callbacks: [{node: a, budget_ms: {value: 5, from: given}}, {node: a, period_ms: {value: 5, from: "
       "given}}]",
       "second entry for a (timer)"}};
  for (const auto& [text, part] : wrong) {
    EXPECT_THAT([&] { (void)parse_contract("a contract", text); },
                testing::ThrowsMessage<InputError>(HasSubstr(part)))
        << text;
  }
}

}  // namespace hotpath::watch::contract_test
