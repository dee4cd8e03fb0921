// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hotpath/analysis/random_stream.hpp"
#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

/// Kramer, Ziegenbein, Hamann: "Real world automotive benchmarks for free", WATERS 2015: runnables of one
/// period. Execution times in microseconds.
struct WatersPeriod {
  int period_ms = 0;
  double share = 0;                       ///< Of all runnables, percent; 15 more are angle-synchronous.
  double acet_min = 0, acet_max = 0;      ///< Average execution time, us.
  double factor_min = 0, factor_max = 0;  ///< WCET / ACET.
  double shape = 0, rate = 0;             ///< Weibull of the ACET (scale 1 / rate us); 0: uniform.
};
extern const std::array<WatersPeriod, 9> kWatersPeriods;

/// One runnable as a task: its period by share, its WCET an average execution time within the table's range
/// times a uniform factor, in whole nanoseconds.
PeriodicTask waters_runnable(RandomStream& random);

/// A task set of the paper's Section VII-B: one task for each runnable, D = T, in rate-monotonic order
/// (stable). Runnables are drawn one after the other until the utilisation is within [utilisation,
/// utilisation + 0.01]; one that overshoots is dropped. Drawing lazily gives the same distribution as popping
/// from a shuffled pool of 30000. `utilisation` in (0, 1); throws AnalysisError otherwise.
PeriodicTasks waters_task_set(double utilisation, RandomStream& random);

/// Cause-effect chains of such a set: 30 to 59 attempts of 1 to 3 activation patterns (70, 20, 10 %) over
/// distinct periods of the set, each with 2 to 5 distinct tasks (30, 40, 20, 10 %); an attempt for which a
/// period has too few tasks is dropped. None for fewer than three distinct periods.
std::vector<TaskChain> waters_chains(const PeriodicTasks& tasks, RandomStream& random);

}  // namespace hotpath
