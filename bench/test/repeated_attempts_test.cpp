// SPDX-License-Identifier: Apache-2.0
// Which repetitions are repeated and which attempt counts, tested with synthetic attempts.
#include "live/repeated_attempts.hpp"

#include <gmock/gmock.h>

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

/// 10 s of work that takes `factor` times as long in the second half.
results::Repetition repetition(std::uint32_t number, double factor) {
  results::Repetition r;
  r.trace.repetition = number;
  for (Duration begin{}; begin < 10s; begin += results::SpeedWatch::kWindow) {
    const double pace = begin < 5s ? 1 : factor;
    r.speed.push_back({1, begin, begin + results::SpeedWatch::kWindow, from_ms(400 * pace), 400ms});
  }
  return r;
}

struct Attempts : testing::Test {
  /// `factors`: the slowness of each attempt in turn; 0: the attempt fails.
  void repeat(std::uint32_t times, std::vector<double> factors) {
    live::repeat_slow(
        runs, 3, times,
        [&](const live::Attempt& a) -> std::optional<results::Repetition> {
          made.push_back(a);
          const double factor = factors.at(made.size() - 1);
          if (factor == 0) return std::nullopt;
          return repetition(a.number, factor);
        },
        [&](const live::Attempt& a, const std::vector<results::SlowPeriod>& wrong) {
          EXPECT_FALSE(wrong.empty());
          replaced.emplace_back(a.counted, a.number);
        });
  }
  [[nodiscard]] std::vector<std::uint32_t> counted(std::size_t e) const {
    std::vector<std::uint32_t> numbers;
    for (const results::Repetition& r : runs[e].repetitions) numbers.push_back(r.trace.repetition);
    return numbers;
  }

  std::vector<results::ExecutorRuns> runs = {{"default", {}}, {"rm-ro", {}}};
  std::vector<live::Attempt> made;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> replaced;

  void SetUp() override {
    runs[0].repetitions = {repetition(0, 1), repetition(1, 1), repetition(2, 1)};
    runs[1].repetitions = {repetition(0, 1), repetition(1, 1.3), repetition(2, 1)};
  }
};

TEST_F(Attempts, OnlyWhatWasSlowIsMeasuredAgain) {
  repeat(5, {1});
  ASSERT_EQ(made.size(), 1);
  EXPECT_EQ(made[0].executor, 1);
  EXPECT_EQ(made[0].repetition, 1);
  EXPECT_EQ(made[0].number, 3);
  EXPECT_THAT(replaced, ElementsAre(std::pair(1U, 3U)));
  EXPECT_THAT(counted(0), ElementsAre(0, 1, 2));
  EXPECT_THAT(counted(1), ElementsAre(0, 2, 3));
}

TEST_F(Attempts, NothingSlowIsNothingToRepeat) {
  runs[1].repetitions[1] = repetition(1, 1);
  repeat(5, {});
  EXPECT_THAT(made, IsEmpty());
}

TEST_F(Attempts, ZeroTimesRepeatNothing) {
  repeat(0, {});
  EXPECT_THAT(made, IsEmpty());
}

TEST_F(Attempts, EndAfterThatManyWithTheLeastDisturbedOne) {
  repeat(3, {1.5, 1.2, 1.4});
  ASSERT_EQ(made.size(), 3);
  for (const live::Attempt& a : made) EXPECT_EQ(a.repetition, 1) << "always the phases of that repetition";
  EXPECT_THAT(replaced, ElementsAre(std::pair(1U, 4U)));
  EXPECT_THAT(counted(1), ElementsAre(0, 2, 4));
}

TEST_F(Attempts, FollowEachOtherUntilOneIsUndisturbed) {
  repeat(5, {1.2, 1});
  EXPECT_THAT(replaced, ElementsAre(std::pair(1U, 3U), std::pair(3U, 4U)));
  EXPECT_EQ(made[1].counted, 3);
  EXPECT_THAT(counted(1), ElementsAre(0, 2, 4));
}

TEST_F(Attempts, OneThatFailsLeavesTheFirst) {
  repeat(2, {0, 0});
  EXPECT_THAT(replaced, IsEmpty());
  EXPECT_THAT(counted(1), ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace hotpath
