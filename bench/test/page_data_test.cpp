// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include <set>

#include "explain/totals.hpp"
#include "page/listed_outputs.hpp"
#include "page/stored_jobs.hpp"

namespace hotpath::page {
namespace {

using explain::Output;

std::vector<Output> outputs(std::size_t count) {
  std::vector<Output> all;
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back({0, i, Duration(static_cast<std::int64_t>((i * 7919) % 1009))});
  }
  return all;
}

TEST(ListedOutputs, FewAreAllListed) {
  EXPECT_EQ(listed(outputs(100), 100).size(), 100U);
  EXPECT_TRUE(listed({}, 10).empty());
}

TEST(ListedOutputs, OfManyTheWorstHalfAndOthersFromBeginningToEnd) {
  const std::vector<Output> all = outputs(1000);
  const std::vector<Output> some = listed(all, 100);
  EXPECT_LE(some.size(), 100U);
  EXPECT_GT(some.size(), 80U);  // some of the evenly distributed ones are among the worst
  EXPECT_TRUE(std::ranges::is_sorted(some, {}, &Output::sequence));
  std::set<std::uint64_t> sequences;
  for (const Output& output : some) sequences.insert(output.sequence);
  for (const Output& output : explain::sorted_by_latency(all)) {
    const auto slower =
        std::ranges::count_if(all, [&](const Output& o) { return o.latency > output.latency; });
    EXPECT_TRUE(slower >= 50 || sequences.contains(output.sequence));
  }
  for (std::uint64_t i = 0; i < 1000; i += 20) EXPECT_TRUE(sequences.contains(i));
}

TEST(JobColumns, HoldDifferencesThatSumToTheJobs) {
  JobColumns columns(2);
  const auto at = [](std::int64_t ns) { return Time(Duration(ns)); };
  JobRecord timer{{0, 5, at(100), at(110), kNever, {}}, at(150), at(180)};
  JobRecord sample{{1, 3, at(170), at(170), kNever, {0, 5}}, at(200)};
  sample.outcome = Outcome::running;
  sample.worker = 1;
  columns.add(timer);
  columns.add(sample);
  timer.job.sequence = 6;
  timer.start = at(300);
  timer.finish = at(301);
  columns.add(timer);
  const nlohmann::json expected = {{"task", {0, 1, 0}},
                                   {"sequence", {5, 3, 1}},
                                   {"start", {150, 50, 100}},
                                   {"length", {30, -1, 1}},
                                   {"before_timestamp", {50, 30, 200}},
                                   {"before_release", {40, 30, 190}},
                                   {"worker", {0, 1, 0}},
                                   {"parent", {-1, 0, -1}},
                                   {"parent_sequence", {0, -2, 0}}};
  EXPECT_EQ(columns.columns(), expected);
}

}  // namespace
}  // namespace hotpath::page
