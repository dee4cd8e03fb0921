// SPDX-License-Identifier: Apache-2.0
#include "setup/executor_spec.hpp"

#include <gmock/gmock.h>

#include "hotpath/core/input_file.hpp"
#include "program/errors.hpp"

namespace hotpath::executor_spec_test {
namespace {

using ::testing::AllOf;
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

TEST(ExecutorSpec, MultiTakesItsNumberOfThreads) {
  EXPECT_EQ(setup::parse_executor("multi:1", {}).scheduler.workers, 1U);
  EXPECT_EQ(setup::parse_executor("multi:" + std::to_string(kMaxWorkers), {}).scheduler.workers, kMaxWorkers);
  EXPECT_THAT(refusal("multi:0"), HasSubstr("between 1 and " + std::to_string(kMaxWorkers)));
  EXPECT_THAT(refusal("multi:" + std::to_string(kMaxWorkers + 1)), HasSubstr("between 1 and"));
  EXPECT_THAT(refusal("multi:-1"), HasSubstr("`-1`"));
  EXPECT_THAT(refusal("multi:2x"), HasSubstr("`2x`"));
}

TEST(ExecutorSpec, UnknownNamesAreRefusedWithThoseThatThereAre) {
  EXPECT_THAT(refusal("best"), AllOf(HasSubstr("no executor `best`"), HasSubstr("rm-ro"), HasSubstr("cbg")));
  EXPECT_THAT(refusal("rm"), HasSubstr("no executor `rm`; did you mean `rm-ro` or `rm-re`?"));
  EXPECT_THAT(refusal("edf-or"), HasSubstr("no executor `edf-or`; did you mean `edf-ro`?"));
  EXPECT_THAT(refusal(""), HasSubstr("no executor ``"));
  EXPECT_THAT(refusal(":first"), HasSubstr("no executor ``"));
}

TEST(ExecutorSpec, VariantsThatAnExecutorDoesNotHaveAreRefused) {
  EXPECT_THAT(refusal("rm-ro:last"), AllOf(HasSubstr("`last`"), HasSubstr("inherit, first, lifo, fifo")));
  EXPECT_THAT(refusal("rm-ro:"), HasSubstr("no variant ``"));
  EXPECT_THAT(refusal("rm-ro:first:"), HasSubstr("no variant ``"));
  EXPECT_THAT(refusal("rm-ro:4"), HasSubstr("`4`"));
  EXPECT_THAT(refusal("default:first"), HasSubstr("`first`"));
  EXPECT_THAT(refusal("events-ro:fifo"), HasSubstr("`fifo`"));
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

TEST(ExecutorSpec, EveryExecutorOfTheRegistryCanBeNamed) {
  EXPECT_EQ(setup::all_executor_names().size(), executors().size());
  for (const std::string& name : setup::all_executor_names())
    EXPECT_EQ(setup::parse_executor(name, {}).entry->name, name);
}

}  // namespace
}  // namespace hotpath::executor_spec_test
