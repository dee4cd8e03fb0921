// SPDX-License-Identifier: Apache-2.0
// The rules by which callbacks publish.
#include <gmock/gmock.h>

#include <tuple>

#include "recorded.hpp"

namespace hotpath::publication_rules_test {

using imports::InferredRule;
using testing::ElementsAre;

/// The rules of a node with subscriptions 0 and 1. Each job is given by its subscription, and behind it the
/// topics that it publishes (a: 0, b: 1, ...).
std::vector<InferredRule> inferred(const std::string& jobs) {
  RecordedCallbacks r;
  r.system.topics.resize(4);
  for (const std::uint32_t topic : {1U, 2U}) r.callback(tracing::CallbackKind::subscription, 0, topic);
  for (const char c : jobs) {
    if (c == '0' || c == '1') r.job(c == '0' ? 0U : 1U, 0, Duration{}, Duration{});
    if (c >= 'a') r.jobs.back().published.push_back({static_cast<std::uint32_t>(c - 'a'), {}});
  }
  return imports::infer_rules(r.system, r.jobs, {true, true});
}

TEST(PublicationRules, TheOneThatExplainsMostJobsWins) {
  struct Case {
    const char *name, *jobs;
    PublishRule rule;
    std::vector<std::uint32_t> publishers, of;
    std::uint64_t explained;
    std::uint32_t n = 1, first = 0;
  };
  for (const Case& c : std::vector<Case>{
           {"a set that either input completes", "0 1a 1 0a 0 0 1a", PublishRule::all_new, {0, 1}, {0, 1}, 7},
           {"a set begins anew with each message; the trace begins within a set",
            "0a 1 0a 0 1a 1 0a",
            PublishRule::all_new,
            {0, 1},
            {0, 1},
            6},
           {"every third, wherever the trace begins",
            "0 0a 0 0 0a 0 0 0a",
            PublishRule::every,
            {0},
            {},
            8,
            3,
            2},
           {"an input that never completes a set, though it had the chance",
            "1 1 0a 1 1 0a 1 1 0a",
            PublishRule::last_of,
            {0},
            {1},
            9},
           {"inputs that do not fit are kept", "0a 0a 1 0a 0a 0a", PublishRule::last_of, {0}, {1}, 6},
       }) {
    const std::vector<InferredRule> rules = inferred(c.jobs);
    ASSERT_EQ(rules.size(), 1U) << c.name;
    const InferredRule& r = rules[0];
    EXPECT_EQ(std::tie(r.rule, r.publishers, r.of, r.explained, r.n, r.first),
              std::tie(c.rule, c.publishers, c.of, c.explained, c.n, c.first))
        << c.name;
  }
}

TEST(PublicationRules, AnInputThatPublishesOtherTopicsIsInNoSet) {
  const auto rule = testing::AllOf(testing::Field(&InferredRule::rule, PublishRule::always),
                                   testing::Field(&InferredRule::explained, 6U));
  EXPECT_THAT(inferred("1d 0a 1d 0a 1d 0a"), ElementsAre(rule, rule));
}

}  // namespace hotpath::publication_rules_test
