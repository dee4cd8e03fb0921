// SPDX-License-Identifier: Apache-2.0
#include "import/publication_rules.hpp"

#include <gtest/gtest.h>

#include "import/recorded_executors.hpp"

namespace hotpath {
namespace {

/// A node with subscriptions 0 and 1; each job is of one of them and publishes these topics.
std::vector<imports::InferredRule> inferred_of(
    const std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>>& made) {
  tracing::System system;
  system.nodes.resize(1);
  system.topics.resize(4);
  for (const std::uint32_t topic : {1U, 2U}) {
    tracing::Callback& c = system.callbacks.emplace_back();
    c.kind = tracing::CallbackKind::subscription;
    c.node = 0;
    c.topic = topic;
  }
  std::vector<tracing::Job> jobs;
  for (const auto& [callback, topics] : made) {
    tracing::Job& job = jobs.emplace_back();
    job.ref.callback = callback;
    for (const std::uint32_t topic : topics) job.published.push_back({topic, {}});
  }
  return imports::infer_rules(system, jobs, {true, true});
}

/// The same, if each job publishes topic 0 or nothing.
std::vector<imports::InferredRule> inferred(const std::vector<std::pair<std::uint32_t, bool>>& made) {
  std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>> jobs;
  jobs.reserve(made.size());
  for (const auto& [callback, publishes] : made)
    jobs.emplace_back(callback, publishes ? std::vector<std::uint32_t>{0} : std::vector<std::uint32_t>{});
  return inferred_of(jobs);
}

TEST(PublicationRules, FusionIsASetThatEitherInputCompletes) {
  const auto rules =
      inferred({{0, false}, {1, true}, {1, false}, {0, true}, {0, false}, {0, false}, {1, true}});
  ASSERT_EQ(rules.size(), 1U);
  EXPECT_EQ(rules[0].rule, PublishRule::all_new);
  EXPECT_EQ(rules[0].of, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(rules[0].explained, 7U);
}

TEST(PublicationRules, ASetBeginsAnewWithEachMessage) {
  const auto rules =
      inferred({{0, true}, {1, false}, {0, true}, {0, false}, {1, true}, {1, false}, {0, true}});
  ASSERT_EQ(rules.size(), 1U);
  EXPECT_EQ(rules[0].rule, PublishRule::all_new);
  EXPECT_EQ(rules[0].explained, 6U) << "the trace begins within a set";
}

TEST(PublicationRules, AnInputThatPublishesOtherTopicsIsInNoSet) {
  const auto rules = inferred_of({{1, {3}}, {0, {0}}, {1, {3}}, {0, {0}}, {1, {3}}, {0, {0}}});
  ASSERT_EQ(rules.size(), 2U);
  for (const imports::InferredRule& rule : rules) {
    EXPECT_EQ(rule.rule, PublishRule::always);
    EXPECT_EQ(rule.explained, 6U);
  }
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

/// A thread with timers only shares an executor with the only other thread of its process.
TEST(RecordedExecutors, ATimerThreadBelongsToTheOnlyOtherThread) {
  for (const std::uint32_t others : {1U, 2U}) {
    tracing::System system;
    system.processes = {7};
    for (std::uint32_t t = 0; t <= others; ++t) {
      tracing::Thread& thread = system.threads.emplace_back();
      thread.process = 7;
      thread.id = t;
      tracing::Callback& callback = system.callbacks.emplace_back();
      callback.kind = t == 0 ? tracing::CallbackKind::timer : tracing::CallbackKind::subscription;
      callback.node = t;
      callback.threads[t] = 1;
    }
    EXPECT_EQ(imports::recorded_executors(system).executors.size(), others == 1 ? 1U : 3U);
  }
}

TEST(RecordedExecutors, UsualProcessorsRanOneInAHundredJobs) {
  tracing::Thread thread;
  thread.jobs = 1000;
  thread.processors = {{0, 981}, {2, 9}, {3, 10}};
  EXPECT_EQ(imports::usual_processors(thread), (std::vector<std::int32_t>{0, 3}));
}

}  // namespace
}  // namespace hotpath
