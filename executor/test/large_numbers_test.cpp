// SPDX-License-Identifier: Apache-2.0
// Sequence numbers, and instants in microseconds, beyond 32 bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "hotpath/core/trace_csv.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test {
namespace {

constexpr std::uint64_t kBeyond = std::uint64_t{1} << 32;

TEST(LargeNumbers, OccurInASimulationOfHours) {
  TaskSet set;
  const TaskId fast = add_timer(set, 1ns, 100ms);  // each of its jobs skips 10^8 timestamps
  const TaskId slow = add_timer(set, 60s, 1ms);
  const TaskId subscription = add_subscription(set, {slow}, 1ms);
  const Trace trace = run(set, "default", 2h);
  EXPECT_EQ(legal(set, trace), "");
  EXPECT_EQ(balanced(set, trace), "");
  const JobRecord& last = *std::find_if(trace.jobs.rbegin(), trace.jobs.rend(), started);
  EXPECT_EQ(last.job.task, fast);
  EXPECT_GT(last.job.sequence, kBeyond);
  EXPECT_EQ(last.job.sequence, static_cast<std::uint64_t>((last.job.timestamp - trace.epoch).count()));
  EXPECT_GT(static_cast<std::uint64_t>((last.start - trace.epoch) / 1us), kBeyond);
  EXPECT_EQ(count(trace, subscription, Outcome::ran), 120U);
}

TEST(LargeNumbers, AreKeptInJobsCsv) {
  TaskSet set;
  const TaskId timer = add_timer(set, 1s, 1ms);
  const TaskId subscription = add_subscription(set, {timer}, 1ms);
  Trace trace;
  trace.executor = "default";
  JobRecord& r = trace.jobs.emplace_back();
  r.job.task = subscription;
  r.job.sequence = kBeyond + 1;
  r.job.parent = {timer, kBeyond + 2};
  r.job.timestamp = r.job.release = r.start = at(std::chrono::microseconds(kBeyond + 3));
  r.finish = r.start + 1ms;
  std::stringstream file;
  file << kJobsCsvHeader << '\n';
  write_jobs_csv(file, set, trace);
  const JobRecord back = read_jobs_csv(file, set, "jobs.csv").at(0).jobs.at(0);
  EXPECT_EQ(back.job.sequence, r.job.sequence);
  EXPECT_EQ(back.job.parent, r.job.parent);
  EXPECT_EQ(back.start, r.start);
  EXPECT_EQ(back.finish, r.finish);
}

}  // namespace
}  // namespace hotpath::test
