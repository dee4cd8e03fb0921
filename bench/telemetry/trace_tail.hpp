// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "hotpath/reference_system/run_memory.hpp"

namespace hotpath {

/// Reads what the processes of a run record, while they do, without their notice: each call returns what is
/// new, a state of all logs at one instant, so that a job never comes before one that it waited for.
class TraceTail {
 public:
  explicit TraceTail(const std::deque<RunMemory>& memories);

  struct News {
    std::vector<JobRecord> jobs;                 ///< In order of finish.
    std::vector<ChainObservation> observations;  ///< In order of the sinks' starts.
  };
  News read();

 private:
  using Counts = std::vector<std::size_t>;
  Counts count() const;

  std::vector<RecordLog<JobRecord>> jobs_;
  std::vector<RecordLog<ChainObservation>> chains_;
  Counts seen_;  ///< Of the logs of jobs, then of those of chains.
};

}  // namespace hotpath
