// SPDX-License-Identifier: Apache-2.0
#include "setup/executor_spec.hpp"

#include <gmock/gmock.h>

#include "hotpath/core/input_file.hpp"
#include "program/errors.hpp"

namespace hotpath::executor_spec_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

std::string refusal(const std::string& text) {
  try {
    setup::parse_executor(text, {});
  } catch (const program::UsageError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ExecutorSpec, VariantsPrevailOverTheDefaultsAndStandInTheLabel) {
  using enum SubscriptionRule;
  struct Case {
    const char *label, *name;
    SchedulerOptions defaults, scheduler;
    setup::Stack stack = setup::Stack::native;
  };
  for (const Case& c : {Case{"rm-ro", "rm-ro", {first, Ties::fifo, 3}, {first, Ties::fifo, 3}},
                        Case{"multi:3@rclcpp", "multi", {}, {.workers = 3}, setup::Stack::rclcpp},
                        Case{"edf-re:inherit:fifo", "edf-re", {first, Ties::lifo}, {inherit, Ties::fifo}},
                        Case{"rm-ro:first", "rm-ro", {}, {first}},
                        Case{"rm-ro:lifo", "rm-ro", {inherit, Ties::fifo}, {inherit, Ties::lifo}}}) {
    const setup::ExecutorSpec spec = setup::parse_executor(c.label, c.defaults);
    EXPECT_EQ(spec.label, c.label);
    EXPECT_EQ(spec.entry->name, c.name);
    EXPECT_EQ(spec.scheduler.rule, c.scheduler.rule) << c.label;
    EXPECT_EQ(spec.scheduler.ties, c.scheduler.ties) << c.label;
    EXPECT_EQ(spec.scheduler.workers, c.scheduler.workers) << c.label;
    EXPECT_EQ(spec.stack, c.stack) << c.label;
  }
}

TEST(ExecutorSpec, WhatThereIsNotIsRefusedWithWhatThereIs) {
  const std::string most = std::to_string(kMaxWorkers), more = std::to_string(kMaxWorkers + 1);
  EXPECT_EQ(setup::parse_executor("multi:1", {}).scheduler.workers, 1U);
  EXPECT_EQ(setup::parse_executor("multi:" + most, {}).scheduler.workers, kMaxWorkers);
  for (const auto& [text, said] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"multi:0", {"between 1 and " + most}},
           {"multi:" + more, {"between 1 and"}},
           {"multi:-1", {"`-1`"}},
           {"multi:2x", {"`2x`"}},
           {"best", {"no executor `best`", "rm-ro", "cbg"}},
           {"rm", {"no executor `rm`; did you mean `rm-ro` or `rm-re`?"}},
           {"edf-or", {"no executor `edf-or`; did you mean `edf-ro`?"}},
           {"", {"no executor ``"}},
           {":first", {"no executor ``"}},
           {"rm-ro:last", {"`last`", "inherit, first, lifo, fifo"}},
           {"rm-ro:", {"no variant ``"}},
           {"rm-ro:first:", {"no variant ``"}},
           {"rm-ro:4", {"`4`"}},
           {"default:first", {"`first`"}},
           {"events-ro:fifo", {"`fifo`"}}})
    for (const std::string& part : said) EXPECT_THAT(refusal(text), HasSubstr(part));
}

TEST(ExecutorSpec, ATimerThreadNeedsAPriorityAboveItsExecutor) {
  const auto deployed = [](const std::string& executor, const std::string& policy) -> std::string {
    Deployment plan;
    plan.name = "plan";
    plan.file = "plan.yaml";
    plan.executors = {
        {.name = "e", .executor = executor, .policy = parse_thread_policy(policy), .processors = {}}};
    try {
      static_cast<void>(setup::deploy(plan, {}));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(deployed("rm-ro", "fifo:98"), "accepted");
  EXPECT_THAT(deployed("rm-ro", "fifo:99"), HasSubstr("cannot have a priority above fifo:99"));
  EXPECT_THAT(deployed("rm-ro", "deadline:1/5/10"), HasSubstr("cannot have a priority above deadline"));
  EXPECT_EQ(deployed("default", "fifo:99"), "accepted");
}

TEST(ExecutorSpec, ThePaperComparesSevenExecutors) {
  EXPECT_THAT(setup::paper_executor_names(),
              ElementsAre("default", "static", "events-ro", "rm-ro", "rm-re", "edf-ro", "edf-re"));
  EXPECT_THAT(setup::all_executor_names(), IsSupersetOf(setup::paper_executor_names()));
}

}  // namespace hotpath::executor_spec_test
