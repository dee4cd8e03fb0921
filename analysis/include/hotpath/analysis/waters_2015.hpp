// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hotpath/analysis/random_stream.hpp"
#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Runnables of one period (Kramer, Ziegenbein, Hamann: "Real world automotive benchmarks for
/// free", WATERS 2015). Execution times in microseconds.
struct WatersPeriod {
  int period_ms = 0;
  double share = 0;                       ///< Percent of all runnables; a further 15 % are angle-synchronous.
  double acet_min = 0, acet_max = 0;      ///< Average execution time, us.
  double factor_min = 0, factor_max = 0;  ///< WCET / ACET.
  double shape = 0, rate = 0;             ///< Weibull of the ACET (scale 1 / rate us); 0: uniform.
};
extern const std::array<WatersPeriod, 9> kWatersPeriods;

/// Draws one runnable as a task: the period by its share; the WCET as an average execution time in
/// the table's range times a uniform factor, in whole nanoseconds.
PeriodicTask waters_runnable(RandomStream& random);

/// Draws a task set of the paper's Section VII-B: one task per runnable, D = T, in rate-monotonic
/// order (stable). Draws runnables one at a time until the utilisation is within [utilisation,
/// utilisation + 0.01]; drops a runnable that overshoots. This has the same distribution as drawing
/// from a shuffled pool of 30000. `utilisation` in (0, 1); throws AnalysisError otherwise.
PeriodicTasks waters_task_set(double utilisation, RandomStream& random);

/// Draws cause-effect chains of such a set: 30 to 59 attempts of 1 to 3 activation patterns (70,
/// 20, 10 %) over distinct periods of the set, each with 2 to 5 distinct tasks (30, 40, 20, 10 %).
/// Drops an attempt if a period has too few tasks. Returns no chains for fewer than three distinct
/// periods.
std::vector<TaskChain> waters_chains(const PeriodicTasks& tasks, RandomStream& random);

}  // namespace hotpath
