// SPDX-License-Identifier: Apache-2.0
#include "import/publication_rules.hpp"

#include <gtest/gtest.h>

#include "import/recorded_executors.hpp"

namespace hotpath {
namespace {

/// A node with subscriptions 0 and 1; for each of `jobs`, `publisher` publishes topic 0 according
/// to `made`.
std::vector<imports::InferredRule> inferred(const std::vector<std::pair<std::uint32_t, bool>>& made) {
  tracing::System system;
  system.nodes.resize(1);
  system.topics.resize(3);
  for (const std::uint32_t topic : {1U, 2U}) {
    tracing::Callback& c = system.callbacks.emplace_back();
    c.kind = tracing::CallbackKind::subscription;
    c.node = 0;
    c.topic = topic;
  }
  std::vector<tracing::Job> jobs;
  for (const auto& [callback, publishes] : made) {
    tracing::Job& job = jobs.emplace_back();
    job.ref.callback = callback;
    if (publishes) job.published.push_back({0, {}});
  }
  return imports::infer_rules(system, jobs, {true, true});
}

TEST(PublicationRules, FusionIsASetThatEitherInputCompletes) {
  const auto rules =
      inferred({{0, false}, {1, true}, {1, false}, {0, true}, {0, false}, {0, false}, {1, true}});
  ASSERT_EQ(rules.size(), 1U);
  EXPECT_EQ(rules[0].rule, PublishRule::all_new);
  EXPECT_EQ(rules[0].of, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(rules[0].explained, 7U);
}

TEST(PublicationRules, EveryThirdWhereverTheTraceBegins) {
  const auto rules =
      inferred({{0, false}, {0, true}, {0, false}, {0, false}, {0, true}, {0, false}, {0, false}, {0, true}});
  ASSERT_EQ(rules.size(), 1U);
  EXPECT_EQ(rules[0].rule, PublishRule::every);
  EXPECT_EQ(rules[0].n, 3U);
  EXPECT_EQ(rules[0].explained, 8U);
}

TEST(PublicationRules, InputsThatDoNotFitAreKept) {
  const auto rules = inferred({{0, true}, {0, true}, {1, false}, {0, true}, {0, true}, {0, true}});
  ASSERT_EQ(rules.size(), 1U);
  EXPECT_EQ(rules[0].rule, PublishRule::last_of);
  EXPECT_EQ(rules[0].publishers, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(rules[0].of, (std::vector<std::uint32_t>{1}));
}

/// Thread ids repeat if the processes run in two containers.
TEST(RecordedExecutors, ThreadsOfTwoProcessesMayHaveOneId) {
  tracing::System system;
  for (const std::uint32_t process : {7U, 8U}) {
    const auto index = static_cast<std::uint32_t>(system.threads.size());
    system.processes.insert(process);
    tracing::Thread& thread = system.threads.emplace_back();
    thread.process = process;
    thread.id = 1;
    tracing::Callback& timer = system.callbacks.emplace_back();
    timer.kind = tracing::CallbackKind::timer;
    timer.node = index;
    timer.threads[index] = 1;
  }
  const auto found = imports::recorded_executors(system).executors;
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].name, "process_7_thread_1");
  EXPECT_EQ(found[1].name, "process_8_thread_1");
}

}  // namespace
}  // namespace hotpath
