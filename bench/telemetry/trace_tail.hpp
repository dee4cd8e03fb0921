// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "hotpath/reference_system/run_memory.hpp"

namespace hotpath::telemetry {

/// Reads the records of a run's processes during the run without disturbing them. Each call returns
/// the new records of a consistent snapshot of all logs, so a job never precedes a job that it
/// waited for.
class TraceTail {
 public:
  explicit TraceTail(const std::deque<RunMemory>& memories) {
    for (const RunMemory& memory : memories) {
      jobs_.insert(jobs_.end(), memory.jobs().begin(), memory.jobs().end());
      chains_.insert(chains_.end(), memory.chains().begin(), memory.chains().end());
    }
    seen_.assign(jobs_.size() + chains_.size(), 0);
  }

  struct News {
    std::vector<JobRecord> jobs;                 ///< In order of finish.
    std::vector<ChainObservation> observations;  ///< In order of the sinks' starts.
  };
  News read() {
    // Logs only grow: if two passes have equal counts, these are a snapshot of a time between them.
    Counts counts = count();
    for (Counts again = count(); again != counts; again = count()) counts = std::move(again);

    News news;
    const auto append = [&](const auto& log, std::size_t index, auto& to) {
      const auto records = log.contents();
      to.insert(to.end(), records.begin() + static_cast<std::ptrdiff_t>(seen_[index]),
                records.begin() + static_cast<std::ptrdiff_t>(counts[index]));
    };
    for (std::size_t i = 0; i < jobs_.size(); ++i) append(jobs_[i], i, news.jobs);
    for (std::size_t i = 0; i < chains_.size(); ++i) append(chains_[i], jobs_.size() + i, news.observations);
    seen_ = std::move(counts);
    std::ranges::stable_sort(news.jobs, {}, &JobRecord::finish);
    std::ranges::stable_sort(news.observations, {}, &ChainObservation::sink_start);
    return news;
  }

 private:
  using Counts = std::vector<std::size_t>;
  Counts count() const {
    Counts counts;
    for (const auto& log : jobs_) counts.push_back(log.contents().size());
    for (const auto& log : chains_) counts.push_back(log.contents().size());
    return counts;
  }

  std::vector<RecordLog<JobRecord>> jobs_;
  std::vector<RecordLog<ChainObservation>> chains_;
  Counts seen_;  ///< Records read from each log of jobs, then from each log of chains.
};

}  // namespace hotpath::telemetry
