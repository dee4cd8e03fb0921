// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"

#include <algorithm>
#include <ctime>
#include <latch>
#include <nlohmann/json.hpp>
#include <thread>

#include "hotpath/live/thread_setup.hpp"

namespace hotpath {

namespace {

std::int64_t read_clock(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec;
}

/// Cheapest of a few rounds, so that interruptions do not count.
double clock_cost(clockid_t clock) {
  constexpr int kReadings = 200;
  double best = 1e9;
  for (int round = 0; round < 20; ++round) {
    const std::int64_t begin = read_clock(CLOCK_MONOTONIC);
    for (int i = 0; i < kReadings; ++i) read_clock(clock);
    best = std::min(best, static_cast<double>(read_clock(CLOCK_MONOTONIC) - begin) / kReadings);
  }
  return best;
}

HiccupHistogram watch(Duration length) {
  HiccupHistogram distances;
  std::int64_t before = read_clock(CLOCK_MONOTONIC);
  const std::int64_t end = before + length.count();
  while (before < end) {
    const std::int64_t now = read_clock(CLOCK_MONOTONIC);
    distances.add(Duration(now - before));
    before = now;
  }
  return distances;
}

std::string microseconds(Duration d) { return std::to_string(d.count() / 1000) + " us"; }

}  // namespace

Hiccups HiccupHistogram::summary(int cpu) const {
  if (distances_.count() == 0) return {cpu};
  return {cpu, distances_.quantile(0.99), distances_.quantile(0.999), distances_.max(),
          100 * to_ms(lost_) / to_ms(std::max(total_, Duration(1)))};
}

MachineNoise measure_noise(Duration length) {
  MachineNoise noise;
  noise.length = length;
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  noise.clock_resolution = std::chrono::seconds(resolution.tv_sec) + Duration(resolution.tv_nsec);
  noise.clock_cost_ns = clock_cost(CLOCK_MONOTONIC);
  noise.cpu_clock_cost_ns = clock_cost(CLOCK_THREAD_CPUTIME_ID);

  const std::vector<int> cpus = allowed_cpus();
  noise.cores.resize(cpus.size());
  std::latch together(static_cast<std::ptrdiff_t>(cpus.size()));
  std::vector<std::thread> watchers;
  for (std::size_t i = 0; i < cpus.size(); ++i) {
    watchers.emplace_back([&, i] {
      pin_to_cpus({cpus[i]});
      together.arrive_and_wait();
      noise.cores[i] = watch(length).summary(cpus[i]);
    });
  }
  for (std::thread& w : watchers) w.join();
  return noise;
}

static void to_json(nlohmann::json& j, const Hiccups& h) {
  j = {{"cpu", h.cpu},
       {"p99_ns", h.p99.count()},
       {"p999_ns", h.p999.count()},
       {"max_ns", h.max.count()},
       {"lost_percent", h.lost_percent}};
}

void to_json(nlohmann::json& j, const MachineNoise& noise) {
  j = {{"watched_ms", to_ms(noise.length)},
       {"hiccups", noise.cores},
       {"clock_resolution_ns", noise.clock_resolution.count()},
       {"clock_cost_ns", noise.clock_cost_ns},
       {"cpu_clock_cost_ns", noise.cpu_clock_cost_ns}};
}

std::vector<std::string> warnings(const MachineNoise& noise) {
  std::vector<std::string> sentences;
  const auto worst = std::max_element(noise.cores.begin(), noise.cores.end(),
                                      [](const Hiccups& a, const Hiccups& b) { return a.max < b.max; });
  if (worst != noise.cores.end() && worst->max > std::chrono::microseconds(500)) {
    sentences.push_back("A thread that only read the clock on processor " + std::to_string(worst->cpu) +
                        " was held up for " + microseconds(worst->max) +
                        ": single latencies of that size need not be the executor's.");
  }
  for (const Hiccups& h : noise.cores) {
    if (h.lost_percent < 2) continue;
    sentences.push_back("On processor " + std::to_string(h.cpu) + " a busy thread lost " +
                        std::to_string(h.lost_percent).substr(0, 4) + " % of its time to others.");
  }
  if (noise.clock_cost_ns > 200) {
    sentences.push_back("Reading the clock costs " + std::to_string(static_cast<int>(noise.clock_cost_ns)) +
                        " ns, so it is not read in user space: look at the clock source.");
  }
  return sentences;
}

}  // namespace hotpath
