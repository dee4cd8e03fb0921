// SPDX-License-Identifier: Apache-2.0
// The rules by which callbacks publish.
#include <gmock/gmock.h>

#include "recorded.hpp"

namespace hotpath {
namespace {

using imports::InferredRule;
using testing::ElementsAre;
using Jobs = std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>>;

/// The rules of a node with subscriptions 0 and 1; each job is of one of them and publishes these topics.
std::vector<InferredRule> inferred(const Jobs& made) {
  RecordedCallbacks r;
  r.system.topics.resize(4);
  for (const std::uint32_t topic : {1U, 2U}) r.callback(tracing::CallbackKind::subscription, 0, topic);
  for (const auto& [callback, topics] : made) {
    tracing::Job& job = r.job(callback, 0, Duration{}, Duration{});
    for (const std::uint32_t topic : topics) job.published.push_back({topic, {}});
  }
  return imports::infer_rules(r.system, r.jobs, {true, true});
}

TEST(PublicationRules, TheOneThatExplainsMostJobsWins) {
  const std::vector<std::uint32_t> yes = {0}, no = {};
  struct Case {
    const char* name;
    Jobs jobs;
    PublishRule rule;
    std::vector<std::uint32_t> publishers, of;
    std::uint64_t explained;
    std::uint32_t n = 1;
  };
  for (const Case& c : std::vector<Case>{
           {"a set that either input completes",
            {{0, no}, {1, yes}, {1, no}, {0, yes}, {0, no}, {0, no}, {1, yes}},
            PublishRule::all_new,
            {0, 1},
            {0, 1},
            7},
           {"a set begins anew with each message; the trace begins within a set",
            {{0, yes}, {1, no}, {0, yes}, {0, no}, {1, yes}, {1, no}, {0, yes}},
            PublishRule::all_new,
            {0, 1},
            {0, 1},
            6},
           {"every third, wherever the trace begins",
            {{0, no}, {0, yes}, {0, no}, {0, no}, {0, yes}, {0, no}, {0, no}, {0, yes}},
            PublishRule::every,
            {0},
            {},
            8,
            3},
           {"inputs that do not fit are kept",
            {{0, yes}, {0, yes}, {1, no}, {0, yes}, {0, yes}, {0, yes}},
            PublishRule::last_of,
            {0},
            {1},
            6},
       }) {
    const std::vector<InferredRule> rules = inferred(c.jobs);
    ASSERT_EQ(rules.size(), 1U) << c.name;
    EXPECT_EQ(rules[0].rule, c.rule) << c.name;
    EXPECT_EQ(rules[0].publishers, c.publishers) << c.name;
    EXPECT_EQ(rules[0].of, c.of) << c.name;
    EXPECT_EQ(rules[0].explained, c.explained) << c.name;
    EXPECT_EQ(rules[0].n, c.n) << c.name;
  }
}

TEST(PublicationRules, AnInputThatPublishesOtherTopicsIsInNoSet) {
  const auto rule = testing::AllOf(testing::Field(&InferredRule::rule, PublishRule::always),
                                   testing::Field(&InferredRule::explained, 6U));
  EXPECT_THAT(inferred({{1, {3}}, {0, {0}}, {1, {3}}, {0, {0}}, {1, {3}}, {0, {0}}}),
              ElementsAre(rule, rule));
}

}  // namespace
}  // namespace hotpath
