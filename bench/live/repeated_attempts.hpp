// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "results/run_record.hpp"
#include "results/summary.hpp"

namespace hotpath::live {

/// An attempt at a repetition. The first attempt has the number of its repetition and counts; more
/// attempts follow where it ran on a slow processor.
struct Attempt {
  std::size_t executor = 0;      ///< Index of its ExecutorRuns.
  std::uint32_t repetition = 0;  ///< Number in the plan; it decides the phases.
  std::uint32_t counted = 0;     ///< Number of the attempt that has counted until now.
  std::uint32_t number = 0;      ///< Number of this attempt.
};

/// Numbers of repetitions.
struct SpeedCounts {
  std::size_t observed = 0;  ///< Their jobs show the speed of their processors.
  std::size_t slow = 0;      ///< They ran on a slow processor.
};

/// Judges the repetitions with judge_speed().
[[nodiscard]] SpeedCounts count_slow(const std::vector<results::ExecutorRuns>& runs);

/// Measures the repetitions that ran on a slow processor again, at most `times` each. This happens
/// after all other repetitions, so that the disturbance has time to pass. Of two attempts `runs`
/// keeps the one that lost less time. `planned`: repetitions of each executor; attempts are
/// numbered from there on. `measure` returns none if the attempt failed; `replaced` is called when
/// an attempt replaces the counted one, with the slow periods of the replaced attempt.
void repeat_slow(
    std::vector<results::ExecutorRuns>& runs, std::uint32_t planned, std::uint32_t times,
    const std::function<std::optional<results::Repetition>(const Attempt&)>& measure,
    const std::function<void(const Attempt&, const std::vector<results::SlowPeriod>& slow)>& replaced);

/// Records in `runs` of run.json that the counted attempt replaces this one, if it is another.
void record_attempt(std::vector<results::RepetitionRecord>& runs, const std::string& executor,
                    const Attempt& attempt);

/// Records in `runs` of run.json that the attempt replaces the counted one.
void record_replacement(std::vector<results::RepetitionRecord>& runs, const std::string& executor,
                        const Attempt& attempt);

}  // namespace hotpath::live
