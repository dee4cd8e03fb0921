// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath::gbench {

/// What one live measurement found: its time, and further values by name. Units are the
/// endings of names.
struct Measurement {
  double time_ns = 0;
  std::vector<std::pair<std::string, double>> counters;

  /// Adds NAME_p50_ns, NAME_p99_ns, NAME_p999_ns and NAME_max_ns, and makes the median the measurement's time
  /// when there is none yet. Throws std::runtime_error when there are no samples.
  void add_samples(const std::string& name, std::vector<double> samples_ns);
};

/// Runs `measure` in a new process, so that nothing that ran before has an influence, and makes its
/// values the benchmark's: manual time and counters. A measurement that throws or dies becomes the
/// benchmark's error. The calling process must have one thread only.
void run_isolated(benchmark::State& state, const std::function<Measurement()>& measure);

/// Registers a benchmark that run_isolated() runs once.
benchmark::internal::Benchmark* register_isolated(const std::string& name,
                                                  const std::function<Measurement()>& measure);

/// The samples without the first tenth of them, in which a measurement warms up.
std::vector<double> warm(std::vector<double> samples);

/// CPU time of the calling process so far, all threads.
Duration process_cpu_time();

}  // namespace hotpath::gbench
