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

namespace hotpath {

/// What a processor did of the nodes' work in a stretch of a repetition.
struct SpeedWindow {
  int cpu = -1;
  Duration begin{}, end{};  ///< Since the epoch.
  Duration busy{};          ///< Time that went by in jobs of known work.
  Duration work{};          ///< What these jobs take on the processor as it was calibrated.
};

/// A stretch of a repetition in which a processor did the same work more slowly than usual in this run.
struct SlowPeriod {
  int cpu = -1;
  Duration begin{}, end{};  ///< Since the epoch.
  double factor = 1;        ///< By which the work took longer.
};

/// Reads the speed of processors from jobs whose work is a fixed amount. The time in which a processor has
/// jobs of the run is held against the work of these jobs, so that jobs which preempt each other, or share
/// the processor, are no slowness. Where threads were seen on several processors, only jobs that overlap no
/// other one tell anything. Memory is needed for the jobs of one window.
class SpeedWatch {
 public:
  static constexpr Duration kWindow = std::chrono::milliseconds(500);
  /// Shorter jobs consist of publication rather than of work.
  static constexpr Duration kLeastJob = std::chrono::microseconds(100);
  /// Around the work of each job: taking the sample, publication.
  static constexpr Duration kOverhead = std::chrono::microseconds(50);

  /// `set` has the work of each job as its `wcet`, and must outlive the watch. Jobs that start in the warm-up
  /// do not count.
  SpeedWatch(const TaskSet& set, Time epoch, Duration warm_up) : set_(set), epoch_(epoch), window_(warm_up) {}

  /// In the order of starts. What did not run to its end tells nothing.
  void add(const JobRecord& job);

  [[nodiscard]] std::vector<SpeedWindow> finish() &&;

 private:
  struct Span {
    Duration begin{}, end{};  // since the epoch
    Duration work{};
    bool known = true;  // false: it only stored its sample, say, and `work` is the time that it took
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
  std::vector<SpeedWindow> shared_, alone_;      // by all jobs of a processor, by those that overlap no other
};

/// The windows of a repetition's jobs, which are in the order of their starts.
[[nodiscard]] std::vector<SpeedWindow> speed_windows(const TaskSet& set, const Trace& trace,
                                                     Duration warm_up);

/// Time per work that is usual in a run with these repetitions: what the fastest fifth of the time stays
/// below, or 1, the pace of the calibration, if even that is clearly slower. No value: there was too little
/// work to tell.
[[nodiscard]] std::optional<double> usual_pace(const std::vector<std::span<const SpeedWindow>>& repetitions);

/// Stretches of one repetition in which the work took at least kSlowFactor times as long as usual, by
/// processor.
inline constexpr double kSlowFactor = 1.1;
[[nodiscard]] std::vector<SlowPeriod> slow_periods(std::span<const SpeedWindow> windows, double usual);

/// Part of a sentence: when, where and by how much. The first few.
[[nodiscard]] std::string describe(std::span<const SlowPeriod> slow);

/// Time lost in these.
[[nodiscard]] Duration lost_time(std::span<const SlowPeriod> slow);

}  // namespace hotpath
