// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/time.hpp"
#include "hotpath/live/clock.hpp"

namespace hotpath::microbench {

using namespace std::chrono_literals;

/// Nanoseconds from one instant to a later one.
inline double ns(Duration d) { return static_cast<double>(d.count()); }

/// CPU time of the calling process so far, all threads.
inline Duration process_cpu_time() { return read_clock(CLOCK_PROCESS_CPUTIME_ID); }

/// Median without the first `share` of the samples, in which a measurement warms up. Throws
/// std::runtime_error if there is no sample.
inline double warm_median(std::vector<double> samples, double share = 0.1) {
  const auto skipped = static_cast<std::ptrdiff_t>(static_cast<double>(samples.size()) * share);
  samples.erase(samples.begin(), samples.begin() + skipped);
  const Quantiles q = quantiles(std::move(samples));
  if (q.n == 0) throw std::runtime_error("nothing was measured");
  return q.p50;
}

/// What one live measurement found: its time, and further values by name. Units are the
/// endings of names.
struct Measurement {
  double time_ns = 0;
  std::map<std::string, double> counters;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Measurement, time_ns, counters)

/// Runs `measure` in a new process, so that nothing that ran before has an influence, and makes its
/// values the benchmark's: manual time and counters. A measurement that throws or dies becomes the
/// benchmark's error. The calling process must have one thread only.
inline void run_isolated(benchmark::State& state, const std::function<Measurement()>& measure) {
  for (auto _ : state) {
    const std::unique_ptr<FILE, int (*)(FILE*)> answer(std::tmpfile(), std::fclose);
    const pid_t child = answer ? fork() : -1;
    if (child < 0) return state.SkipWithError(std::strerror(errno));
    if (child == 0) {
      nlohmann::json found;
      try {
        found = measure();
        if (!std::isfinite(found.at("time_ns").get<double>())) throw std::runtime_error("not a number");
      } catch (const std::exception& error) {
        found = std::string("failed ") + error.what();
      }
      const std::vector<std::uint8_t> bytes = nlohmann::json::to_cbor(found);
      const bool written = std::fwrite(bytes.data(), 1, bytes.size(), answer.get()) == bytes.size();
      _exit(written && std::fflush(answer.get()) == 0 ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (status != 0) return state.SkipWithError("the process of the measurement died");
    std::rewind(answer.get());
    const auto found = nlohmann::json::from_cbor(answer.get());
    if (found.is_string()) return state.SkipWithError(found.get<std::string>().c_str());
    const auto measured = found.get<Measurement>();
    state.SetIterationTime(measured.time_ns / 1e9);
    state.counters.insert(measured.counters.begin(), measured.counters.end());
  }
}

/// Registers a benchmark that run_isolated() runs once.
inline void register_isolated(const std::string& name, const std::function<Measurement()>& measure) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) { run_isolated(s, measure); })
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

/// Registers the benchmarks of a program: each defines it, and benchmark_main.cpp calls it.
void register_all(bool quick);

}  // namespace hotpath::microbench
