// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
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

/// The samples without the first `share` of them, in which a measurement warms up.
inline std::vector<double> warm(std::vector<double> samples, double share = 0.1) {
  const auto skipped = static_cast<std::ptrdiff_t>(static_cast<double>(samples.size()) * share);
  samples.erase(samples.begin(), samples.begin() + skipped);
  return samples;
}

/// What one live measurement found: its time, and further values by name. Units are the
/// endings of names.
struct Measurement {
  double time_ns = 0;
  std::map<std::string, double> counters;

  /// Adds NAME_p50_ns, NAME_p99_ns, NAME_p999_ns and NAME_max_ns, and makes the median the measurement's time
  /// when there is none yet. Throws std::runtime_error when there are no samples.
  Measurement& add_samples(const std::string& name, std::vector<double> samples_ns) {
    const Quantiles q = quantiles(std::move(samples_ns));
    if (q.n == 0) throw std::runtime_error("nothing was measured for " + name);
    if (time_ns == 0) time_ns = q.p50;
    counters.insert({{name + "_p50_ns", q.p50},
                     {name + "_p99_ns", q.p99},
                     {name + "_p999_ns", q.p999},
                     {name + "_max_ns", q.max}});
    return *this;
  }

  void report(benchmark::State& state) const {
    state.SetIterationTime(time_ns / 1e9);
    state.counters.insert(counters.begin(), counters.end());
  }
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
        if (!std::isfinite(found.at("time_ns").get<double>()))
          throw std::runtime_error("nothing was measured");
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
    found.get<Measurement>().report(state);
  }
}

/// Registers a benchmark that run_isolated() runs once.
inline benchmark::internal::Benchmark* register_isolated(const std::string& name,
                                                         const std::function<Measurement()>& measure) {
  return benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) { run_isolated(s, measure); })
      ->Iterations(1)
      ->UseManualTime();
}

/// Registers the benchmarks of a program: each defines it, and benchmark_main.cpp calls it.
void register_all(bool quick);

}  // namespace hotpath::microbench
