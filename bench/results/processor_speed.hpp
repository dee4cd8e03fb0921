// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/task.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath::results {

/// The work of the nodes that a CPU executed in a window of a repetition.
struct SpeedWindow {
  int cpu = -1;
  Duration begin{}, end{};  ///< Since the epoch.
  Duration busy{};          ///< Time spent in jobs of known work.
  Duration work{};          ///< Time that these jobs take at the calibrated speed.
};

/// A period of a repetition in which a CPU executed work more slowly than usual in this run.
struct SlowPeriod {
  int cpu = -1;
  Duration begin{}, end{};  ///< Since the epoch.
  double factor = 1;        ///< Time for the work divided by the usual time.
};

/// Estimates the speed of CPUs from jobs with a fixed amount of work. It compares the time in which
/// a CPU has jobs of the run with the work of these jobs, so jobs that preempt each other or share
/// the CPU do not count as slow. For threads that ran on several CPUs, only jobs without overlap
/// count. Needs memory for the jobs of one window.
class SpeedWatch {
 public:
  static constexpr Duration kWindow = std::chrono::milliseconds(500);
  /// Shorter jobs consist mostly of publication.
  static constexpr Duration kLeastJob = std::chrono::microseconds(100);
  /// Time of each job besides its work: taking the sample, publication.
  static constexpr Duration kOverhead = std::chrono::microseconds(50);

  /// The `wcet` of a task in `set` is the work of its jobs; `set` must outlive the watch. Jobs that
  /// start in the warm-up do not count.
  SpeedWatch(const TaskSet& set, Time epoch, Duration warm_up) : set_(set), epoch_(epoch), window_(warm_up) {}

  /// Adds a job, in order of start. Ignores jobs that did not finish.
  void add(const JobRecord& job);

  [[nodiscard]] std::vector<SpeedWindow> finish() &&;

 private:
  struct Span {
    Duration begin{}, end{};  // since the epoch
    Duration work{};
    bool known = true;  // false: the job only stored its sample, for example; `work` is its duration
    std::uint16_t worker = 0;
    std::int16_t cpu = -1;
  };

  void close_window();
  using Windows = std::map<int, SpeedWindow>;  // by processor
  void measure(const std::vector<Span>& spans, std::size_t most, Windows& windows) const;

  const TaskSet& set_;
  const Time epoch_;
  Duration window_{};  // its begin
  std::vector<Span> spans_;
  std::map<std::uint16_t, std::set<int>> seen_;  // processors of each worker
  std::vector<SpeedWindow> shared_, alone_;      // from all jobs of a CPU, from jobs without overlap
};

/// The windows of a repetition, whose jobs are in order of start.
[[nodiscard]] std::vector<SpeedWindow> speed_windows(const TaskSet& set, const Trace& trace,
                                                     Duration warm_up);

/// The usual time per work in a run with these repetitions: the 20th percentile over all windows,
/// or 1, the pace of the calibration, if that percentile is clearly slower. std::nullopt: too
/// little work.
[[nodiscard]] std::optional<double> usual_pace(const std::vector<std::span<const SpeedWindow>>& repetitions);

inline constexpr double kSlowFactor = 1.1;
/// Periods of one repetition, by CPU, in which the work took at least kSlowFactor times the usual
/// time.
[[nodiscard]] std::vector<SlowPeriod> slow_periods(std::span<const SpeedWindow> windows, double usual);

/// Part of a sentence with time, CPU and factor of the first few periods.
[[nodiscard]] std::string describe(std::span<const SlowPeriod> slow);

/// The time lost in these periods.
[[nodiscard]] Duration lost_time(std::span<const SlowPeriod> slow);

/// The total length of these periods, of the CPU that was slow for the longest time.
[[nodiscard]] Duration slow_time(std::span<const SlowPeriod> slow);

}  // namespace hotpath::results
