// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// Another attempt at a repetition that ran on a slow processor.
struct Attempt {
  std::size_t executor = 0;      ///< Index of its ExecutorRuns.
  std::uint32_t repetition = 0;  ///< Of the plan.
  std::uint32_t counted = 0;     ///< Number of the attempt that has counted until now.
  std::uint32_t number = 0;      ///< Of this one.
};

/// Has repetitions measured again, at most `times` each, that ran on a slow processor by judge_speed(), after
/// all others, so that the disturbance has time to pass. Of two attempts `runs` keeps the one that lost less
/// time. `planned`: repetitions of each executor; attempts are numbered from there on. `measure` returns none
/// where it failed; `replaced` is called when an attempt takes the place of the one that counted, with what
/// was wrong with that one.
void repeat_disturbed(
    std::vector<ExecutorRuns>& runs, std::uint32_t planned, std::uint32_t times,
    const std::function<std::optional<Repetition>(const Attempt&)>& measure,
    const std::function<void(const Attempt&, const std::vector<SlowPeriod>& wrong)>& replaced);

}  // namespace hotpath
