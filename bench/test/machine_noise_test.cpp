// SPDX-License-Identifier: Apache-2.0
// The noise floor, which `hotpath machine` prints and every result folder records, and its quantiles.
#include "machine/machine.hpp"

#include <unistd.h>

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "hotpath/live/thread_setup.hpp"
#include "machine/proc_files.hpp"

namespace hotpath::machine_noise_test {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(LatencyHistogram, QuantilesAreWithinOnePercentOfTheSortedSamples) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> microseconds(6, 2);
  program::LatencyHistogram histogram;
  std::vector<double> sorted;
  for (int i = 0; i < 20000; ++i) {
    const Duration sample(static_cast<std::int64_t>(1000 * microseconds(random)));
    histogram.add(sample);
    sorted.push_back(static_cast<double>(sample.count()));
  }
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(histogram.count(), sorted.size());
  EXPECT_EQ(static_cast<double>(histogram.max().count()), sorted.back());
  for (const double p : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const double exact = sorted[static_cast<std::size_t>(std::ceil(p * 20000)) - 1];
    EXPECT_NEAR(static_cast<double>(histogram.quantile(p).count()) / exact, 1, 0.01) << p;
  }
}

TEST(LatencyHistogram, SmallNumbersOfSamplesAndExtremesAreExactOrClipped) {
  program::LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), Duration(-1));
  histogram.add(Duration(5));
  EXPECT_EQ(histogram.quantile(0.5), Duration(5));
  EXPECT_EQ(histogram.quantile(1), Duration(5));
  histogram.add(Duration(-3));
  EXPECT_EQ(histogram.quantile(0.5), Duration(0));
  histogram.add(Duration::max());
  EXPECT_LE(histogram.quantile(1), Duration::max());
  EXPECT_GT(histogram.quantile(1), Duration::max() / 100 * 99);
  EXPECT_EQ(histogram.max(), Duration::max());
}

TEST(HiccupHistogram, HasTheQuantilesOfAllDistancesAndTheTimeInGapsOfTenMicrosecondsAndMore) {
  machine::HiccupHistogram one, distances;
  EXPECT_THAT(one.summary(1), testing::FieldsAre(1, 0ns, 0ns, 0ns, 0));
  one.add(2ms);
  EXPECT_THAT(one.summary(0), testing::FieldsAre(0, 2ms, 2ms, 2ms, 100));
  for (int i = 0; i < 9980; ++i) distances.add(20ns);
  for (int i = 0; i < 10; ++i) distances.add(9us);
  for (int i = 0; i < 9; ++i) distances.add(10us);
  distances.add(7ms);
  const machine::Hiccups h = distances.summary(3);
  EXPECT_EQ(h.cpu, 3);
  EXPECT_EQ(h.p99, 20ns);
  EXPECT_NEAR(to_us(h.p999), 9, 0.09);
  EXPECT_EQ(h.max, 7ms);
  EXPECT_NEAR(h.lost_percent, 100 * 7090.0 / (9980 * 0.02 + 90 + 7090), 1e-9);
}

TEST(MachineNoise, WatchesEveryCoreThatTheProcessMayUseAndLeavesTheCallersAffinityAlone) {
  const std::vector<int> before = allowed_cpus();
  const machine::Noise noise = machine::measure_noise(1ms);
  std::vector<int> cpus;
  for (const machine::Hiccups& h : noise.cores) {
    cpus.push_back(h.cpu);
    EXPECT_GT(h.max, 0ns);
    EXPECT_LE(h.p99, h.p999);
    EXPECT_LE(h.p999, h.max);
  }
  EXPECT_EQ(cpus, before);
  EXPECT_EQ(allowed_cpus(), before);
  EXPECT_GE(noise.clock_resolution, 1ns);
  EXPECT_GT(noise.clock_cost_ns, 0);
}

TEST(MachineNoise, IsWarnedOfInWholeSentencesThatNameTheWorstCore) {
  machine::Machine quiet, loud;
  quiet.noise.cores = {{0, 30ns, 200ns, 40us, 0.1}};
  quiet.noise.clock_cost_ns = 22;
  EXPECT_THAT(machine::warnings(quiet), IsEmpty());
  loud.noise.cores = {{0, 30ns, 200ns, 600us, 0.1}, {2, 30ns, 200ns, 3ms, 12.5}};
  loud.noise.clock_cost_ns = 800;
  EXPECT_THAT(machine::warnings(loud), ElementsAre(HasSubstr("CPU 2 was interrupted for 3000 us"),
                                                   HasSubstr("CPU 2 a busy thread lost 12.5 %"),
                                                   HasSubstr("Reading the clock costs 800 ns")));
  for (const std::string& sentence : machine::warnings(loud)) EXPECT_EQ(sentence.back(), '.');
}

TEST(Machine, CountsTimesOfTheProcessorsAskedForInClockTicks) {
  const std::string stat =
      "cpu  900 1 50 4000 7 2 3 133 0 0\ncpu0 400 1 20 2000 3 1 1 33 0 0\ncpu1 450 0 25 1500 2 1 1 97 0 0\n"
      "cpu10 50 0 5 500 2 0 1 3 0 0\nintr 1 2 3\n";
  const Duration tick = Duration(1s) / sysconf(_SC_CLK_TCK);
  EXPECT_EQ(machine::processor_times(stat, {}).stolen, 133 * tick);
  EXPECT_EQ(machine::processor_times(stat, {}).cpus, 3U);
  EXPECT_EQ(machine::processor_times(stat, {}).busy, (423 + 477 + 56) * tick);
  EXPECT_EQ(machine::processor_times(stat, {1}).stolen, 97 * tick);
  EXPECT_EQ(machine::processor_times(stat, {1}).busy, 477 * tick) << "neither idle nor waiting for a disk";
  EXPECT_EQ(machine::processor_times(stat, {0, 10}).stolen, 36 * tick);
  EXPECT_EQ(machine::processor_times("", {0}).cpus, 0U);
  EXPECT_EQ(machine::stolen_times(stat).size(), 3U);
  EXPECT_EQ(machine::stolen_times(stat).at(1), 97 * tick);
}

TEST(Machine, WarnsOfOtherRealTimeThreadsAndStolenTime) {
  machine::Machine machine;
  machine.processors = 2;
  EXPECT_THAT(machine::warnings(machine), IsEmpty());
  machine.real_time_threads = {"jackd (fifo:70)", "x (rr:1)"};
  machine.stolen_percent = 4.25;
  EXPECT_THAT(machine::warnings(machine),
              ElementsAre(HasSubstr("taken 4.25 %"), HasSubstr("jackd (fifo:70) and 1 more")));
}

}  // namespace hotpath::machine_noise_test
