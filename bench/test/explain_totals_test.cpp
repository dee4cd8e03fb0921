// SPDX-License-Identifier: Apache-2.0
// The causes of many outputs: their totals, the tail, and what two executors differ in.
#include <gmock/gmock.h>

#include "explain/explain.hpp"

namespace hotpath::explain::explain_totals_test {

using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;

TEST(Overviews, SeparateTheTail) {
  std::vector<Output> outputs;
  for (std::uint64_t i = 0; i < 250; ++i) outputs.push_back({0, i, i < 248 ? 10ms : 30ms});
  Overview overview(outputs);
  TaskSet set;
  set.tasks.emplace_back().name = "slow";
  for (const Output& output : outputs) {
    Explanation e{0, output.latency, {{}}, true, {{Cause::running, Rule::none, {}, 0, 10ms}}};
    if (output.latency > 10ms) e.parts.push_back({Cause::executor, Rule::fifo, {0, 7}, 0, 20ms});
    overview.add(e);
  }
  EXPECT_EQ(overview.all.outputs, 250U);
  EXPECT_EQ(overview.middle.outputs, 248U);
  EXPECT_EQ(overview.tail.outputs, 2U);
  EXPECT_THAT(
      report({set, "default", "chain"}, overview).sentences,
      Contains(HasSubstr("100 % of the excess over the median (10.0 ms) is waiting for the executor; 100 % "
                         "is waiting behind slow (earlier event (FIFO))")));
}

/// The totals of one output with some causes.
Totals totals_of(std::initializer_list<std::pair<Cause, Duration>> causes) {
  Totals totals;
  totals.outputs = 1;
  for (const auto& [cause, length] : causes) {
    totals.times[{cause}] = length;
    totals.latency += length;
  }
  return totals;
}

TEST(Overviews, GiveLongerAndShorterCausesApart) {
  Overview overview({{0, 0, 10ms}});
  overview.all = overview.middle = totals_of({{Cause::running, 10ms}, {Cause::snapshot, 15ms}});
  overview.tail = totals_of({{Cause::running, 10ms}, {Cause::executor, 18ms}, {Cause::join, 2ms}});
  const TaskSet set;
  EXPECT_EQ(report({set, "default", "chain"}, overview).sentences.back(),
            "Compared with the median (25.0 ms), the worst 1 % (1 of 1 outputs, on average 30.0 ms) spend "
            "20.0 ms more, of which 18.0 ms (90 %) on waiting for the executor and 2.0 ms (10 %) on waiting "
            "for a join's other input or timer, but 15.0 ms less on a wait set's snapshot taken too early.");
}

TEST(Comparisons, GiveSavingsAndLossesApart) {
  const TaskSet set;
  const Totals a = totals_of({{Cause::running, 10ms}, {Cause::executor, 6ms}, {Cause::snapshot, 2ms}});
  Totals b = totals_of({{Cause::running, 10ms}, {Cause::older_sample, 7ms}});
  const auto told = [&] { return report({set, "a", "chain"}, a, {set, "b", "chain"}, b).sentences[1]; };
  EXPECT_EQ(
      told(),
      "It saves 8.0 ms, of which 6.0 ms (75 %) for waiting for the executor and 2.0 ms (25 %) for a wait "
      "set's snapshot taken too early; it adds 7.0 ms for queued behind an older sample.");
  b = totals_of({{Cause::running, 10ms}});
  EXPECT_EQ(told(),
            "It saves 6.0 ms (75 %) of waiting for the executor and 2.0 ms (25 %) of a wait set's snapshot "
            "taken too early.");
}

TEST(Comparisons, NameTheJobsThatOnePathAloneHas) {
  TaskSet set;
  for (const char* const name : {"Lidar", "Camera", "Fusion"}) set.tasks.emplace_back().name = name;
  Totals a = totals_of({{Cause::running, 30ms}}), b = totals_of({{Cause::running, 15ms}});
  const auto of = [](TaskId task) { return Totals::Key{Cause::running, Rule::none, task}; };
  a.times = {{of(1), 20ms}, {of(2), 10ms}};
  b.times = {{of(0), 5ms}, {of(2), 10ms}};
  EXPECT_THAT(report({set, "a", "chain"}, a, {set, "b", "chain"}, b).sentences,
              testing::IsSupersetOf({"On average, the path under a has 20.0 ms more of Camera.",
                                     "On average, the path under b has 5.0 ms more of Lidar."}));
}

}  // namespace hotpath::explain::explain_totals_test
