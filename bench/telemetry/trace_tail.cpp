// SPDX-License-Identifier: Apache-2.0
#include "telemetry/trace_tail.hpp"

#include <algorithm>

namespace hotpath {

TraceTail::TraceTail(const std::deque<RunMemory>& memories) {
  for (const RunMemory& memory : memories) {
    jobs_.insert(jobs_.end(), memory.jobs().begin(), memory.jobs().end());
    chains_.insert(chains_.end(), memory.chains().begin(), memory.chains().end());
  }
  seen_.assign(jobs_.size() + chains_.size(), 0);
}

TraceTail::Counts TraceTail::count() const {
  Counts counts;
  for (const auto& log : jobs_) counts.push_back(log.contents().size());
  for (const auto& log : chains_) counts.push_back(log.contents().size());
  return counts;
}

TraceTail::News TraceTail::read() {
  // Logs only grow: what two passes find alike was there at once, between them.
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
  std::stable_sort(news.jobs.begin(), news.jobs.end(),
                   [](const JobRecord& a, const JobRecord& b) { return a.finish < b.finish; });
  std::stable_sort(
      news.observations.begin(), news.observations.end(),
      [](const ChainObservation& a, const ChainObservation& b) { return a.sink_start < b.sink_start; });
  return news;
}

}  // namespace hotpath
