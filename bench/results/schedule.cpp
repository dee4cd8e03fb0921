// SPDX-License-Identifier: Apache-2.0
#include "results/schedule.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace hotpath::results {

Schedule schedule_of(const TaskSet& set, const Trace& trace) {
  Schedule schedule{set, {}};
  const auto since_epoch = [&](Time t) { return Time{} + (t - trace.epoch); };
  NextCalls next_calls(set);
  for (const JobRecord& r : trace.jobs) next_calls.add(r);
  next_calls.sort();
  for (const JobRecord& r : trace.jobs) {
    if (!r.started()) continue;
    ExecutedJob& job = schedule.jobs.emplace_back(ExecutedJob{r});
    for (Time* const t : {&job.job.timestamp, &job.start, &job.finish}) *t = since_epoch(*t);
    const Time next_call = next_calls.at(r.job.task, r.start);
    if (next_call != kNever) job.next_call = since_epoch(next_call);
  }
  std::ranges::stable_sort(schedule.jobs, {}, &ExecutedJob::start);
  return schedule;
}

Schedule schedule_of(const GoldenTrace& trace, bool release_only) {
  Schedule schedule{trace.set, {}};
  std::vector<Time> next_call;
  for (const Task& task : trace.set.tasks) next_call.push_back(Time{} + task.phase);
  for (const GoldenJob& job : trace.jobs) {
    const Task& task = trace.set[job.task];
    const Time called = std::exchange(next_call[job.task], job.next_call);
    const Time of_its_number = Time{} + task.phase + static_cast<std::int64_t>(job.count) * task.period;
    Job released;
    released.task = job.task;
    released.sequence = job.count;
    released.timestamp = release_only ? of_its_number : called;
    schedule.jobs.push_back({{released, job.start, job.finish}, job.next_call});
  }
  return schedule;
}

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
