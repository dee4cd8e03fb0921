// SPDX-License-Identifier: Apache-2.0
// The simulator against what the real ROS 2 stack did, job by job: the golden traces of the paper's
// timers-only sets (reference_system/ros2_reference). Their timer thread ran at SCHED_FIFO 90, above the
// executor thread.
#include <gtest/gtest.h>

#include <cmath>

#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/job_order.hpp"
#include "hotpath/core/platform.hpp"
#include "task_sets.hpp"

namespace hotpath::test {
namespace {

GoldenTrace reference(const std::string& level, const std::string& executor) {
  return read_golden_trace(std::string(HOTPATH_REFERENCE_DIR) + "/traces/timers_only_" + level + "." +
                           executor + ".csv");
}

/// Simulates the trace's tasks, with its phases and execution times, up to its last start.
Trace simulate_like(const GoldenTrace& real, const std::string& executor, const Platform& platform = {}) {
  return run(real.set, executor, real.jobs.back().start - Time{} + 1ns, platform);
}

JobOrder sequence(const GoldenTrace& real) {
  JobOrder tasks;
  for (const GoldenJob& job : real.jobs) tasks.push_back(job.task);
  return tasks;
}

JobOrder sequence(const Trace& simulated) {
  JobOrder tasks;
  for (const JobRecord& r : simulated.jobs) {
    if (r.outcome == Outcome::ran || r.outcome == Outcome::running) tasks.push_back(r.job.task);
  }
  return tasks;
}

struct Case {
  const char* level;
  const char* executor;
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.executor << '_' << c.level; }

std::string name(const testing::TestParamInfo<Case>& info) {
  std::string n = std::string(info.param.executor) + "_" + info.param.level;
  std::replace(n.begin(), n.end(), '-', '_');
  return n;
}

class IdenticalOrder : public testing::TestWithParam<Case> {};

TEST_P(IdenticalOrder, WithoutAnyCosts) {
  const GoldenTrace real = reference(GetParam().level, GetParam().executor);
  ASSERT_GT(real.jobs.size(), 1500U);
  EXPECT_EQ(sequence(simulate_like(real, GetParam().executor)), sequence(real));
}

INSTANTIATE_TEST_SUITE_P(GoldenTrace, IdenticalOrder,
                         testing::Values(Case{"60", "events-ro"}, Case{"80", "events-ro"},
                                         Case{"90", "events-ro"}, Case{"60", "edf-ro"}, Case{"80", "edf-ro"},
                                         Case{"90", "edf-ro"}, Case{"60", "events-re"},
                                         Case{"90", "events-re"}, Case{"90", "default"}),
                         name);

class IdenticalUpToTies : public testing::TestWithParam<const char*> {};

TEST_P(IdenticalUpToTies, RateMonotonicAmongDifferentPeriods) {
  const GoldenTrace real = reference(GetParam(), "rm-ro");
  ASSERT_GT(real.jobs.size(), 1500U);
  EXPECT_EQ(by_period(sequence(simulate_like(real, "rm-ro")), real.set), by_period(sequence(real), real.set));
}

INSTANTIATE_TEST_SUITE_P(GoldenTrace, IdenticalUpToTies, testing::Values("60", "80", "90"));

class SimilarWithCosts : public testing::TestWithParam<Case> {};

TEST_P(SimilarWithCosts, SequenceAndLostJobs) {
  const GoldenTrace real = reference(GetParam().level, GetParam().executor);
  const Trace simulated =
      simulate_like(real, GetParam().executor, reference_platform(*find_executor(GetParam().executor)));
  JobOrder expected = sequence(real), got = sequence(simulated);
  const std::string executor = GetParam().executor;
  if (executor == "rm-ro") {
    expected = by_period(expected, real.set);
    got = by_period(got, real.set);
  }
  const double similar = similarity(expected, got);
  RecordProperty("similarity", std::to_string(similar));
  EXPECT_GE(similar, 0.98);
  for (TaskId id = 0; id < real.set.size(); ++id) {
    const double timestamps = static_cast<double>(
        1 + (simulated.end - Duration(1) - Time{} - real.set[id].phase) / real.set[id].period);
    const auto lost_percent = [&](const JobOrder& s) {
      return 100 * (1 - static_cast<double>(std::count(s.begin(), s.end(), id)) / timestamps);
    };
    EXPECT_NEAR(lost_percent(sequence(real)), lost_percent(sequence(simulated)), 2.0) << real.set[id].name;
  }
}

INSTANTIATE_TEST_SUITE_P(GoldenTrace, SimilarWithCosts,
                         testing::Values(Case{"60", "default"}, Case{"80", "default"}, Case{"90", "default"},
                                         Case{"60", "static"}, Case{"80", "static"}, Case{"90", "static"},
                                         Case{"60", "events-ro"}, Case{"80", "events-ro"},
                                         Case{"90", "events-ro"}, Case{"60", "events-re"},
                                         Case{"80", "events-re"}, Case{"90", "events-re"},
                                         Case{"60", "rm-ro"}, Case{"80", "rm-ro"}, Case{"90", "rm-ro"},
                                         Case{"60", "edf-ro"}, Case{"80", "edf-ro"}, Case{"90", "edf-ro"}),
                         name);

TEST(GoldenTraceBoundary, WakeUpLatencyAloneDecidesStaticAt60AndEventsReAt80) {
  // Without costs a timer that falls due at the very end of a window is seen by the next one; 100 us later it
  // is together with its neighbours.
  Platform late;
  late.wake_up_latency = 100us;
  const GoldenTrace re = reference("80", "events-re");
  EXPECT_NE(sequence(simulate_like(re, "events-re")), sequence(re));
  EXPECT_EQ(sequence(simulate_like(re, "events-re", late)), sequence(re));
  const GoldenTrace st = reference("60", "static");
  EXPECT_LT(similarity(sequence(simulate_like(st, "static")), sequence(st)), 0.96);
  EXPECT_GT(similarity(sequence(simulate_like(st, "static", late)), sequence(st)), 0.99);
}

}  // namespace
}  // namespace hotpath::test
