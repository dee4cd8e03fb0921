// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

namespace {

/// A task publishes early if it does so before this share of its jobs, and by more than kSoon.
constexpr double kLate = 0.9;
constexpr Duration kSoon = std::chrono::microseconds(100);
/// Shares are rounded to this: jobs of one task vary by more.
constexpr double kStep = 1e-4;

template <class T>
T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

std::vector<EarlyPublication> early_publications(const RecordedGraph& graph,
                                                 std::span<const tracing::Job> jobs) {
  struct Instants {
    std::vector<Duration> before_end;
    std::vector<double> share;
  };
  std::map<std::pair<TaskId, std::uint32_t>, Instants> all;  // by task and topic
  for (const tracing::Job& job : jobs) {
    const TaskId task = graph.task(job.ref);
    if (task == kNoTask || !job.ended || job.finish <= job.start) continue;
    std::map<std::uint32_t, Time> last;  // by topic: a job that publishes twice sends its last message
    for (const tracing::Publication& p : job.published) last[p.topic] = p.at;
    for (const auto& [topic, at] : last) {
      Instants& instants = all[{task, topic}];
      instants.before_end.push_back(job.finish - at);
      instants.share.push_back(to_ms(at - job.start) / to_ms(job.finish - job.start));
    }
  }
  std::vector<EarlyPublication> early;
  for (auto& [from, instants] : all) {
    const double share = std::round(median(instants.share) / kStep) * kStep;
    const Duration before_end = median(instants.before_end);
    if (share < kLate && before_end > kSoon) early.push_back({from.first, from.second, before_end, share});
  }
  std::ranges::stable_sort(early, std::ranges::greater{}, &EarlyPublication::before_end);
  return early;
}

void set_publication_instants(std::span<const EarlyPublication> early, RecordedGraph& graph) {
  for (const EarlyPublication& e : early) {
    const TaskOrigin& origin = graph.tasks.origin[e.task];
    for (Publication& p : graph.graph.nodes[origin.node].callbacks[origin.callback].publishes)
      if (std::ranges::count(graph.topic_names[e.topic], p.topic) > 0) p.at = std::clamp(e.share, 0.0, 1.0);
  }
}

}  // namespace hotpath::imports
