// SPDX-License-Identifier: Apache-2.0
#include "pending_samples.hpp"

#include <gtest/gtest.h>

namespace hotpath::pending_samples_test {

const PendingSamples::Time kNow{};

telemetry::Statistics statistics(const std::string& run, std::size_t nodes) {
  telemetry::Statistics s;
  s.run_id(run);
  s.nodes().resize(nodes);
  return s;
}

TEST(Event, HoldsItsTextsAndSequences) {
  constexpr std::size_t kMany = 100'000;
  const std::string text(kMany, 'x');
  telemetry::RunInfo run;
  run.facts(text);
  EXPECT_GT(bytes_of(run), kMany);
  run.nodes().resize(1000);
  run.nodes()[0].name(text);
  EXPECT_GT(bytes_of(run), 2 * kMany + 1000 * sizeof(telemetry::NodeInfo));
  telemetry::ChainSample sample;
  sample.run_id(text);
  EXPECT_GT(bytes_of(sample), kMany);
}

TEST(PendingSamples, GivesThoseOfOneRunInOrder) {
  PendingSamples pending;
  for (std::uint64_t i = 0; i < 4; ++i) {
    telemetry::Statistics s = statistics(i % 2 == 0 ? "a" : "b", 1);
    s.number(i);
    pending.keep(s, kNow);
  }
  const auto taken = pending.take("b");
  ASSERT_EQ(taken.size(), 2U);
  EXPECT_EQ(std::get<telemetry::Statistics>(taken[1]).number(), 3U);
  EXPECT_TRUE(pending.take("b").empty());
  EXPECT_EQ(pending.take("a").size(), 2U);
}

TEST(PendingSamples, ForgetTheOldest) {
  PendingSamples pending;
  pending.keep(statistics("a", 1), kNow);
  pending.keep(statistics("a", 1), kNow + std::chrono::seconds(2));
  pending.forget(kNow + std::chrono::seconds(1));
  EXPECT_EQ(pending.forgotten(), 1U);
  EXPECT_EQ(pending.take("a").size(), 1U);
}

TEST(PendingSamples, AreBoundedInNumberAndInBytes) {
  PendingSamples pending;
  for (int i = 0; i < 2000; ++i) pending.keep(statistics("a", 1), kNow);
  EXPECT_EQ(pending.take("a").size(), 1024U);
  for (int i = 0; i < 100; ++i) pending.keep(statistics("a", 20'000), kNow);
  std::size_t bytes = 0;
  for (const Event& event : pending.take("a")) bytes += bytes_of(event);
  EXPECT_GT(bytes, 32U << 20);
  EXPECT_LE(bytes, 64U << 20);
}

}  // namespace hotpath::pending_samples_test
