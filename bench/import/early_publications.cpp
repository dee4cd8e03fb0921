// SPDX-License-Identifier: Apache-2.0
#include "import/early_publications.hpp"

#include <algorithm>

namespace hotpath {

namespace {

constexpr double kLate = 0.9;
constexpr Duration kSoon = std::chrono::microseconds(100);

template <class T>
T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

std::vector<EarlyPublication> early_publications(const RecordedGraph& graph,
                                                 std::span<const tracing::Job> jobs) {
  std::vector<std::vector<Duration>> before_end(graph.tasks.set.size());
  std::vector<std::vector<double>> share(graph.tasks.set.size());
  for (const tracing::Job& job : jobs) {
    const TaskId task = graph.task(job.ref);
    if (task == kNoTask || !job.ended || job.published.empty()) continue;
    const Time last = std::ranges::max(job.published, {}, &tracing::Publication::at).at;
    before_end[task].push_back(job.finish - last);
    share[task].push_back(to_ms(last - job.start) / std::max(to_ms(job.finish - job.start), 1e-6));
  }
  std::vector<EarlyPublication> early;
  for (TaskId id = 0; id < before_end.size(); ++id) {
    if (before_end[id].empty()) continue;
    const EarlyPublication typical{id, median(before_end[id]), median(share[id])};
    if (typical.share < kLate && typical.before_end > kSoon) early.push_back(typical);
  }
  std::ranges::sort(early, std::ranges::greater{}, &EarlyPublication::before_end);
  return early;
}

}  // namespace hotpath
