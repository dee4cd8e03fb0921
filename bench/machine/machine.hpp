// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "program/latency_histogram.hpp"

namespace hotpath {

/// How long a thread that only reads the clock was held up on one core, by the kernel, other threads or the
/// hypervisor.
struct Hiccups {
  int cpu = 0;
  Duration p99{}, p999{}, max{};  ///< Of all distances between two readings; within 1 % (LatencyHistogram).
  double lost_percent = 0;        ///< Share of the time that went by in gaps of 10 microseconds and more.
};

/// What the machine does to a measurement by itself.
struct MachineNoise {
  Duration length{};             ///< For how long the cores were watched.
  std::vector<Hiccups> cores;    ///< Those that the process may use.
  Duration clock_resolution{};   ///< Of CLOCK_MONOTONIC, as the kernel says.
  double clock_cost_ns = 0;      ///< One reading of it.
  double cpu_clock_cost_ns = 0;  ///< One reading of a thread's CPU time.
};

/// Distances between consecutive readings of a clock.
class HiccupHistogram {
 public:
  static constexpr Duration kGap = std::chrono::microseconds(10);  ///< From here on time counts as lost.

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
  LatencyHistogram distances_;
  Duration total_{}, lost_{};
};

/// Keeps every allowed core busy for `length`, all at the same time (after rigtorp's hiccups). All threads
/// have ended when it returns. Throws what pin_to_cpus() throws, and std::system_error without a thread.
MachineNoise measure_noise(Duration length);

/// Whole sentences about noise that results will show.
std::vector<std::string> warnings(const MachineNoise& noise);

/// What decides about a result on this machine; stored with every result.
struct Machine {
  std::string cpu_model, kernel, distribution, governor, hypervisor, compiler, build_type;
  int processors = 0;
  bool preempt_rt = false;
  long rt_runtime_us = -1;  ///< Real-time throttling: share of rt_period_us; -1: off or unknown.
  long rt_period_us = 0;
  double load_average = 0;      ///< Over the last minute, when it was read.
  std::string turbo;            ///< `on`, `off`, or `unknown`.
  std::string boot_parameters;  ///< Of the kernel, those that decide where and when threads run.
  std::string clock_source;
  long timer_slack_ns = 0;    ///< Of a new thread under the ordinary policy.
  double stolen_percent = 0;  ///< Of all processors' time since boot, taken by the hypervisor.
  std::vector<std::string> real_time_threads;  ///< Of other programs: `name (fifo:50)`.
  MachineNoise noise;
};

/// How long read_machine() watches the cores for a result folder.
inline constexpr Duration kBriefNoise = std::chrono::milliseconds(200);

Machine read_machine(Duration watch = kBriefNoise);
void to_json(nlohmann::json& j, const Machine& machine);

/// Whole sentences about what may disturb a measurement.
std::vector<std::string> warnings(const Machine& machine);

}  // namespace hotpath
