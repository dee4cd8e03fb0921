// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common_options.hpp"

namespace hotpath {

enum class TimerThread : std::uint8_t { by_executor, raised, equal };

/// What `simulate` is told on the command line.
struct SimulateOptions : CommonOptions {
  std::string phases_of;  ///< Folder of a run whose first timestamps count.
  unsigned cores = 1;
  TimerThread timer_thread = TimerThread::by_executor;
  double release_cost_us = 0, pass_cost_us = 0, dispatch_cost_us = 0;
  double wake_up_us = 0, delivery_delay_us = 0;
  std::string execution_times = "worst";
  std::optional<std::uint64_t> max_backlog;
  unsigned threads = 0;  ///< 0: as many as there are processors.
  bool no_trace = false;
};

}  // namespace hotpath
