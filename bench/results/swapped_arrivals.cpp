// SPDX-License-Identifier: Apache-2.0
#include "results/swapped_arrivals.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace hotpath::results {

std::vector<SwappedArrivals> swapped_arrivals(const GraphTasks& tasks, const Trace& trace) {
  // By subscription: those that a message reaches right before it.
  std::map<TaskId, std::vector<TaskId>> before;
  for (const auto& of_task : tasks.readers) {
    for (const std::vector<TaskId>& topic : of_task) {
      for (std::size_t i = 1; i < topic.size(); ++i) {
        std::vector<TaskId>& known = before[topic[i]];
        if (std::ranges::count(known, topic[i - 1]) == 0) known.push_back(topic[i - 1]);
      }
    }
  }
  using Reached = std::tuple<TaskId, std::uint64_t, TaskId, Time>;  // publishing job, subscription, instant
  std::vector<Reached> arrivals;
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome == Outcome::ran && !is_of_timer(r.job))
      arrivals.emplace_back(r.job.parent.task, r.job.parent.sequence, r.job.task, r.job.release);
  }
  std::ranges::sort(arrivals);
  std::map<std::pair<TaskId, TaskId>, SwappedArrivals> pairs;
  for (const auto& [parent, sequence, task, at] : arrivals) {
    const auto neighbours = before.find(task);
    if (neighbours == before.end()) continue;
    for (const TaskId first : neighbours->second) {
      const auto other = std::ranges::lower_bound(arrivals, Reached{parent, sequence, first, Time::min()});
      if (other == arrivals.end() || std::get<0>(*other) != parent || std::get<1>(*other) != sequence ||
          std::get<2>(*other) != first) {
        continue;
      }
      SwappedArrivals& pair = pairs[{first, task}];
      pair.stated_first = first;
      pair.arrived_first = task;
      ++pair.messages;
      pair.swapped += at < std::get<3>(*other);
    }
  }
  std::vector<SwappedArrivals> swapped;
  for (const auto& [tasks_of_pair, pair] : pairs) {
    if (pair.swapped > 0) swapped.push_back(pair);
  }
  return swapped;
}

}  // namespace hotpath::results
