// SPDX-License-Identifier: Apache-2.0
#include "results/swapped_arrivals.hpp"

#include <map>
#include <set>

namespace hotpath::results {

std::vector<SwappedArrivals> swapped_arrivals(const GraphTasks& tasks, const Trace& trace) {
  std::set<std::pair<TaskId, TaskId>> neighbours;  // a message reaches the second one right after the first
  // By subscription that has a neighbour, then by publishing job: when its sample arrived.
  std::map<TaskId, std::map<std::pair<TaskId, std::uint64_t>, Time>> arrivals;
  for (const auto& of_task : tasks.readers) {
    for (const std::vector<TaskId>& topic : of_task) {
      for (std::size_t i = 1; i < topic.size(); ++i) {
        neighbours.emplace(topic[i - 1], topic[i]);
        for (const TaskId task : {topic[i - 1], topic[i]}) arrivals[task];
      }
    }
  }
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran || is_of_timer(r.job)) continue;
    if (const auto of = arrivals.find(r.job.task); of != arrivals.end())
      of->second[{r.job.parent.task, r.job.parent.sequence}] = r.job.release;
  }
  std::vector<SwappedArrivals> swapped;
  for (const auto& [first, second] : neighbours) {
    SwappedArrivals pair{first, second};
    for (const auto& [message, at] : arrivals[second]) {
      const auto other = arrivals[first].find(message);
      if (other == arrivals[first].end()) continue;
      ++pair.messages;
      pair.swapped += at < other->second;
    }
    if (pair.swapped > 0) swapped.push_back(pair);
  }
  return swapped;
}

}  // namespace hotpath::results
