// SPDX-License-Identifier: Apache-2.0
// The published examples of starvation in the multi-threaded executor (Teper et al., Thread
// Carefully, EMSOFT 2024), compared with the jobs under the real executors of Humble and Jazzy
// (ros2_reference/starvation.csv).
#include <gtest/gtest.h>
#include <filesystem>

#include "hotpath/core/csv.hpp"
#include "schedule_checks.hpp"
#include "starvation_examples.hpp"

namespace hotpath::test {
namespace {

/// Jobs of each timer within 16 s, on two processors with the costs of waiting.
std::vector<std::size_t> jobs(const Example& example, const std::string& executor) {
  const TaskSet set = make_set(example);
  Platform platform = reference_platform(*find_executor(executor), 1);
  platform.cores = 2;
  platform.wall_clock_work = true;
  SchedulerOptions two_threads;
  two_threads.workers = 2;
  // The timers belong to one node and enter the wait set together, from a hash map.
  if (executor == "multi-jazzy") {
    for (TaskId id = set.size(); id-- > 0;) two_threads.entity_order.push_back(id);
  }
  const Trace trace = run(set, executor, 16s + 500ms, platform, two_threads);
  std::vector<std::size_t> counts;
  for (TaskId id = 0; id < set.size(); ++id) {
    counts.push_back(count(trace, id, Outcome::ran) + count(trace, id, Outcome::running));
  }
  return counts;
}

class Starvation : public testing::TestWithParam<Example> {};

TEST_P(Starvation, TheSameTimersStarveAsWithTheRealExecutors) {
  for (CsvReader row(std::filesystem::path(HOTPATH_REFERENCE_DIR) / "starvation.csv"); row.next();) {
    if (row.number<int>("example") != GetParam().number) continue;
    const bool humble = row.text("ros2") == "humble";
    const std::vector<std::size_t> simulated = jobs(GetParam(), humble ? "multi" : "multi-jazzy");
    for (std::size_t i = 0; i < simulated.size(); ++i) {
      const std::string timer = "timer" + std::to_string(i + 1);
      const auto real = row.number<std::size_t>(timer);
      if (real == 0) {
        EXPECT_EQ(simulated[i], 0U) << row.text("ros2") << ' ' << timer;
      } else {
        EXPECT_NEAR(static_cast<double>(simulated[i]), static_cast<double>(real),
                    !humble && GetParam().number == 4 ? 2 : 1)
            << row.text("ros2") << ' ' << timer;
      }
    }
  }
}

TEST_P(Starvation, NobodyStarvesWithTheRemedy) {
  for (const std::size_t jobs_of_timer : jobs(GetParam(), "multi-fair")) EXPECT_GE(jobs_of_timer, 3U);
}

INSTANTIATE_TEST_SUITE_P(Example, Starvation, testing::ValuesIn(kExamples),
                         [](const auto& example) { return std::to_string(example.param.number); });

}  // namespace
}  // namespace hotpath::test
