// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include <set>

#include "page/listed_outputs.hpp"
#include "page/stored_jobs.hpp"

namespace hotpath::page::page_data_test {

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

TEST(PageJob, CountsTimestampAndReleaseBackFromTheStart) {
  const auto at = [](std::int64_t ns) { return Time(Duration(ns)); };
  EXPECT_EQ(job_row({{0, 5, at(100), at(110), kNever, {}}, at(150), at(180)}),
            (PageJob{0, 5, 150, 30, 50, 40, 0}));
  JobRecord sample{{1, 3, at(170), at(170)}, at(200)};
  sample.job.parent = {0, 5};
  sample.outcome = Outcome::running;
  sample.worker = 1;
  EXPECT_EQ(job_row(sample), (PageJob{1, 3, 200, -1, 30, 30, 1}));
}

TEST(ListedOutputs, OnlyTheWorstHaveTheirParts) {
  std::vector<explain::Explanation> explained(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    explained[i].repetition = i;
    explained[i].latency = Duration(10 + i);
    explained[i].path.resize(1);
    explained[i].parts = {{explain::Cause::running, {}, {}, 0, Duration(4)},
                          {explain::Cause::unexplained, {}, {}, 0, Duration(6 + i)}};
  }
  const nlohmann::json outputs = outputs_json(explained, 5);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(outputs[i]["repetition"], 2 - i);
    EXPECT_EQ(outputs[i]["parts"].size(), i < 2 ? 2U : 0U);
    EXPECT_EQ(outputs[i]["causes"][0], 4);
  }
}

}  // namespace hotpath::page::page_data_test
