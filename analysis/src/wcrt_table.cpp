// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/wcrt_table.hpp"

#include <stdexcept>

#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/release_overhead.hpp"
#include "hotpath/core/paper_timers.hpp"

namespace hotpath {

PeriodicTasks paper_timers_only(int utilisation_percent) {
  try {
    return periodic_tasks(paper_timers(utilisation_percent), Policy::rm);
  } catch (const std::invalid_argument& error) {
    throw AnalysisError(error.what());
  }
}

std::array<WcrtColumn, 3> wcrt_table(std::int64_t delta) {
  std::array<WcrtColumn, 3> table{{{.utilisation_percent = 60, .printed_ms = {12.67, 57.83, 70.50}},
                                   {.utilisation_percent = 80, .printed_ms = {16.67, 75.66, 149.50}},
                                   {.utilisation_percent = 90, .printed_ms = {18.67, 83.66, 167.33}}}};
  for (WcrtColumn& column : table) {
    // The table uses Equation (3) alone; tightening with n * delta would change nothing.
    PeriodicTasks tasks = paper_timers_only(column.utilisation_percent);
    const PeriodicTasks bare = tasks;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const auto overhead = release_overhead_ro(bare, i, delta);
      if (!overhead) return table;
      tasks[i].wcet += overhead->overhead;
    }
    const ResponseTimes bounds = brueggen_2015(tasks);
    column.imu = bounds[0];
    column.camera = bounds[4];
    column.lidar = bounds[6];
  }
  return table;
}

}  // namespace hotpath
