// SPDX-License-Identifier: Apache-2.0
// What contracts say of chains, services and publishers.
#include <gmock/gmock.h>

#include <utility>

#include "watching.hpp"

namespace hotpath::watch::chain_contract_test {

using testing::HasSubstr;
using K = tracing::EventKind;

TEST_F(Watching, MeasuresChains) {
  for (int i = 1; i <= 5; ++i) system.run(10 * i, i == 3 ? 1.5 : 1);
  until(60);
  ASSERT_EQ(observer.chains().size(), 1U);
  EXPECT_EQ(observer.chains()[0].hot_path.count(), 5U);
  EXPECT_EQ(observer.chains()[0].hot_path.max(), from_ms(1.5));
  EXPECT_EQ(observer.chains()[0].age.max(), from_ms(2.5));
  observer.threads({facts()}, at_ms(1));
  observer.threads({facts()}, at_ms(61));
  const std::string source = "source (timer)", sink = "space.sink/a";
  const std::vector<std::pair<std::string, std::vector<const char*>>> terms = {
      {"path", {"hot_path_ms", "age_ms", "requirement_ms"}},
      {"main", {"policy", "processors", "wait_ms", "serves"}},
      {"a", {"publishers"}},
      {source, {"publishes", "maximum_distance_ms"}},
      {sink, {"publishes", "lost", "minimum_distance_ms"}}};
  for (const auto& [of, names] : terms)
    for (const char* name : names) EXPECT_EQ(verdict(of, name), "held") << of << " " << name;
  EXPECT_EQ(incident(), "");
}

TEST(WatchingSeveralMessages, CountsThemUnlessTheContractAllowsThem) {
  for (const char* more : {", several: true", ""}) {
    std::string text = kContract;
    Observer observer(parse_contract("a contract", text.insert(text.find("topic: a}") + 8, more)), nullptr);
    WatchedSystem system;
    system.run(10, 1, false);
    const tracing::Event end = system.events.back(), publish = system.events[system.events.size() - 3];
    system.events.back() = publish;
    system.events.push_back(end);
    for (const tracing::Event& event : system.events) observer.event(event);
    EXPECT_EQ(observer.judge().incident().ends_with("published 2 messages of a in one job"), *more == '\0');
  }
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
  EXPECT_EQ(observer.chains()[0].hot_path.count(), 1U);
  EXPECT_EQ(incident(), "");
}

TEST_F(Watching, PrefersTheNamespaceInWhichMoreNodesRun) {
  const std::vector<tracing::Event> later = std::exchange(system.events, {});
  system.add(K::node_init, 0, {70, 71}, {"source", "/sim"});
  system.add(K::publisher_init, 0, {75, 70, 76, 1}, {"/sim/a", ""});
  system.job(0, 0, 73);  // not of a node
  system.events.insert(system.events.end(), later.begin(), later.end());
  until(1);
  system.run(10, 1);
  until(20);
  EXPECT_EQ(observer.chains()[0].hot_path.count(), 1U);
  EXPECT_EQ(incident(), "");
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
    system.create_service(0, 30, 3, "/plan");
    system.create_service(0, 40, 3, "/planner/set_parameters");
    system.add(K::executor_init, 0, {50}, {"rm-ro", ""});
  }
  static constexpr const char* kPlan = "planner/plan (service)";
};

TEST_F(WatchingAService, HoldsWhatEventsTell) {
  for (int i = 1; i <= 3; ++i) system.job(10 * i, 5, 31);
  system.job(40, 9, 41);  // parameters: not in the contract, and no extra callback either
  until(60);
  EXPECT_EQ(incident(), "");
  for (const char* term : {"budget_ms", "publishes"}) EXPECT_EQ(verdict(kPlan, term), "held") << term;
  EXPECT_EQ(verdict("main", "serves"), "held");
  for (const char* term : {"response_ms", "minimum_distance_ms", "depth", "lost"})
    EXPECT_EQ(verdict(kPlan, term), "not observable") << term;
  EXPECT_LT(observer.callbacks().at(2).response.max(), Duration::zero()) << "none";
}

TEST_F(WatchingAService, NamesAServiceThatTheContractLacks) {
  system.job(10, 5, 31);
  system.create_service(15, 60, 3, "/container/load_node");
  system.job(20, 500, 61);
  until(530);
  EXPECT_EQ(incident(),
            "00:00:00.020 main ran /planner /container/load_node (service), which the contract lacks");
}

TEST_F(WatchingAService, ComparesItsResponseWithAnArrivalThatTheExecutorStates) {
  system.add(K::executor_job, 9, {50, 1, 8'000'000, 0});
  system.job(10, 4.5, 31);
  until(30);
  EXPECT_THAT(incident(), HasSubstr("planner/plan (service) responded after 6.500 ms, bound 6.000 ms"));
}

TEST_F(WatchingAService, IsNotTheSubscriptionToATopicOfThatName) {
  system.create_subscription(0, 60, 3, "/plan");
  system.job(10, 1, 31);
  system.job(20, 9, 61);
  until(40);
  EXPECT_EQ(verdict(kPlan, "budget_ms"), "held");
  EXPECT_THAT(incident(), HasSubstr("main ran /planner /plan, which the contract lacks"));
}

TEST_F(Watching, NamesACallbackThatTheContractLacks) {
  system.add(K::node_init, 5, {40, 41}, {"extra", "/"});
  system.create_timer(5, 42, 7'000'000, 40);
  system.run(10, 1);
  system.job(13, 1, 43);
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
  system.take(17, 12345, 0.5);
  until(20);
  EXPECT_EQ(verdict("a", "publishers"), "broken");
  EXPECT_THAT(incident(), HasSubstr("published by a node that is not watched"));
}

TEST_F(Watching, TakesASampleOfBeforeForNoStrangerAfterARestart) {
  system.run(10, 1);
  system.run(20, 1);
  system.add(K::node_init, 22, {50, 4}, {"sink", "/space"});
  system.create_subscription(22, 60, 50, "/a");
  system.take(23, 2, 0.5, 61);  // latched
  for (int i = 3; i <= 6; ++i) {
    system.run(10 * i, 1, false);
    system.take(10 * i + 1, system.stamp, 1, 61);
  }
  until(70);
  EXPECT_EQ(incident(), "");
}

}  // namespace hotpath::watch::chain_contract_test
