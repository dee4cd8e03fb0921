// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "program/json_record.hpp"
#include "program/latency_histogram.hpp"

namespace hotpath::machine {

/// Interruptions of a thread on one core that only reads the clock, by the kernel, other threads or
/// the hypervisor.
struct Hiccups {
  int cpu = 0;
  Duration p99{}, p999{}, max{};  ///< Of the gaps between two readings; within 1 % (LatencyHistogram).
  double lost_percent = 0;        ///< Share of the time spent in gaps of 10 microseconds or more.
};
void fields(auto& visit, program::MaybeConst<Hiccups> auto& part) {
  HOTPATH_VISIT(cpu, lost_percent)
  visit.ns("p99_ns", part.p99);
  visit.ns("p999_ns", part.p999);
  visit.ns("max_ns", part.max);
}

/// How the machine disturbs a measurement.
struct Noise {
  Duration length{};             ///< Observation time.
  std::vector<Hiccups> cores;    ///< The cores that the process may use.
  Duration clock_resolution{};   ///< Of CLOCK_MONOTONIC, as reported by the kernel.
  double clock_cost_ns = 0;      ///< One reading of CLOCK_MONOTONIC.
  double cpu_clock_cost_ns = 0;  ///< One reading of a thread's CPU time.
};
void fields(auto& visit, program::MaybeConst<Noise> auto& part) {
  HOTPATH_VISIT(clock_cost_ns, cpu_clock_cost_ns)
  visit.ms("watched_ms", part.length);
  visit("hiccups", part.cores);
  visit.ns("clock_resolution_ns", part.clock_resolution);
}

/// Gaps between consecutive readings of a clock.
class HiccupHistogram {
 public:
  static constexpr Duration kGap = std::chrono::microseconds(10);  ///< Gaps from here on count as lost time.

  void add(Duration distance) {
    distances_.add(distance);
    total_ += distance;
    if (distance >= kGap) lost_ += distance;
  }
  Hiccups summary(int cpu) const {
    if (distances_.count() == 0) return {cpu};
    return {cpu, distances_.quantile(0.99), distances_.quantile(0.999), distances_.max(),
            100 * to_ms(lost_) / to_ms(std::max(total_, Duration(1)))};
  }

 private:
  program::LatencyHistogram distances_;
  Duration total_{}, lost_{};
};

/// Keeps all allowed cores busy for `length` at the same time (after rigtorp's hiccups), and joins
/// its threads. Throws the exceptions of pin_to_cpus(), and std::system_error if no thread can be
/// created.
Noise measure_noise(Duration length);

/// The properties of this machine that affect results; stored with every result.
struct Machine {
  std::string cpu_model, kernel, distribution, governor, hypervisor, compiler, build_type;
  int processors = 0;
  bool preempt_rt = false;
  long rt_runtime_us = -1;  ///< Real-time throttling: share of rt_period_us; -1: off or unknown.
  long rt_period_us = 0;
  double load_average = 0;      ///< Over the last minute, when it was read.
  std::string turbo;            ///< `on`, `off`, or `unknown`.
  std::string boot_parameters;  ///< The kernel's boot parameters that affect scheduling.
  std::string clock_source;
  long timer_slack_ns = 0;                     ///< Of a new thread in the default scheduling class.
  double stolen_percent = 0;                   ///< Share of all CPU time since boot that the hypervisor took.
  std::vector<std::string> real_time_threads;  ///< Of other programs: `name (fifo:50)`.
  Noise noise;
};
void fields(auto& visit, program::MaybeConst<Machine> auto& part) {
  HOTPATH_VISIT(cpu_model, processors, kernel, preempt_rt, distribution, governor, hypervisor, rt_runtime_us,
                rt_period_us, load_average, compiler, build_type, turbo, clock_source, timer_slack_ns,
                stolen_percent, real_time_threads, noise, boot_parameters)
}

/// The observation time of read_machine() for a result folder.
inline constexpr Duration kBriefNoise = std::chrono::milliseconds(200);

Machine read_machine(Duration watch = kBriefNoise);

/// Sentences about possible disturbances of a measurement.
std::vector<std::string> warnings(const Machine& machine);

}  // namespace hotpath::machine
