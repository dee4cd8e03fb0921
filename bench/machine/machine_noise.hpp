// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// How long a thread that only reads the clock was held up on one core, by the kernel, other threads or the
/// hypervisor.
struct Hiccups {
  int cpu = 0;
  Duration p99{}, p999{}, max{};  ///< Of all distances between two readings.
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
    total_ += distance;
    ++count_;
    if (distance < kGap) {
      ++short_[static_cast<std::size_t>(distance.count())];
    } else {
      gaps_.push_back(distance);
    }
  }
  Hiccups summary(int cpu) const;

 private:
  std::vector<std::uint64_t> short_ = std::vector<std::uint64_t>(static_cast<std::size_t>(kGap.count()));
  std::vector<Duration> gaps_;
  std::uint64_t count_ = 0;
  Duration total_{};
};

/// Keeps every allowed core busy for `length`, all at the same time (after rigtorp's hiccups). All threads
/// have ended when it returns.
MachineNoise measure_noise(Duration length);

nlohmann::json to_json(const MachineNoise& noise);

/// Whole sentences about noise that results will show.
std::vector<std::string> warnings(const MachineNoise& noise);

}  // namespace hotpath
