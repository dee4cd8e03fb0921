// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"

#include <algorithm>
#include <ctime>
#include <exception>
#include <future>
#include <latch>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "program/text.hpp"

namespace hotpath::machine {

namespace {

/// The minimum of several rounds, to exclude interruptions.
double clock_cost(clockid_t clock) {
  constexpr int kReadings = 200;
  double best = 1e9;
  for (int round = 0; round < 20; ++round) {
    const std::int64_t begin = read_clock(CLOCK_MONOTONIC).count();
    for (int i = 0; i < kReadings; ++i) static_cast<void>(read_clock(clock));
    best = std::min(best, static_cast<double>(read_clock(CLOCK_MONOTONIC).count() - begin) / kReadings);
  }
  return best;
}

HiccupHistogram watch(Duration length) {
  HiccupHistogram distances;
  std::int64_t before = read_clock(CLOCK_MONOTONIC).count();
  const std::int64_t end = before + length.count();
  while (before < end) {
    const std::int64_t now = read_clock(CLOCK_MONOTONIC).count();
    distances.add(Duration(now - before));
    before = now;
  }
  return distances;
}

}  // namespace

Noise measure_noise(Duration length) {
  Noise noise;
  noise.length = length;
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  noise.clock_resolution = std::chrono::seconds(resolution.tv_sec) + Duration(resolution.tv_nsec);
  noise.clock_cost_ns = clock_cost(CLOCK_MONOTONIC);
  noise.cpu_clock_cost_ns = clock_cost(CLOCK_THREAD_CPUTIME_ID);

  const std::vector<int> cpus = allowed_cpus();
  noise.cores.resize(cpus.size());
  std::latch together(static_cast<std::ptrdiff_t>(cpus.size()));
  const auto work = [&](std::size_t i) {
    try {
      pin_to_cpus({cpus[i]});
    } catch (const std::exception&) {
      together.count_down();
      throw;
    }
    together.arrive_and_wait();
    noise.cores[i] = watch(length).summary(cpus[i]);
  };
  std::vector<std::future<void>> watchers;  // whose destructors join the threads
  for (std::size_t i = 0; i < cpus.size(); ++i) {
    try {
      watchers.push_back(std::async(std::launch::async, work, i));
    } catch (const std::exception&) {
      together.count_down(static_cast<std::ptrdiff_t>(cpus.size() - i));
      throw;
    }
  }
  for (std::future<void>& w : watchers) w.get();
  return noise;
}

std::vector<std::string> warnings(const Noise& noise) {
  std::vector<std::string> sentences;
  const auto worst = std::ranges::max_element(noise.cores, {}, &Hiccups::max);
  if (worst != noise.cores.end() && worst->max > std::chrono::microseconds(500)) {
    sentences.push_back(
        program::concat("A thread that only read the clock on CPU ", worst->cpu, " was interrupted for ",
                        worst->max.count() / 1000,
                        " us: the executor need not be the cause of single latencies of that size."));
  }
  for (const Hiccups& h : noise.cores) {
    if (h.lost_percent < 2) continue;
    sentences.push_back(program::text("On CPU %d a busy thread lost %.4s %% of its time to interruptions.",
                                      h.cpu, std::to_string(h.lost_percent).c_str()));
  }
  if (noise.clock_cost_ns > 200) {
    sentences.push_back(
        program::text("Reading the clock costs %d ns, so it needs a system call; check the clock source.",
                      static_cast<int>(noise.clock_cost_ns)));
  }
  return sentences;
}

}  // namespace hotpath::machine
