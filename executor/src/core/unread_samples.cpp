// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/unread_samples.hpp"

#include <cassert>

namespace hotpath {

UnreadSamples::UnreadSamples(const TaskSet& set) : readers_(set.size()) {
  std::uint32_t total = 0;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind != TaskKind::subscription) continue;
    assert(set[id].depth >= 1);
    readers_[id].first = total;
    readers_[id].depth = set[id].depth;
    total += set[id].depth;
  }
  entries_.resize(total);
}

Job UnreadSamples::job(TaskId task, const Entry& e) const {
  Job job;
  job.task = task;
  job.sequence = e.sequence;
  job.timestamp = e.sample.published;
  job.deadline = e.sample.deadline;
  job.parent = e.sample.parent;
  return job;
}

UnreadSamples::Added UnreadSamples::add(TaskId task, const SampleInfo& sample) {
  Reader& r = readers_[task];
  assert(r.depth > 0 && "not a subscription");
  Added added;
  if (r.count == r.depth) {
    added.overwritten = take(task);
  }
  Entry& e = entries_[r.first + (r.head + r.count) % r.depth];
  e = {r.arrived++, sample};
  ++r.count;
  added.job = job(task, e);
  return added;
}

Job UnreadSamples::take(TaskId task) {
  Reader& r = readers_[task];
  assert(r.count > 0);
  const Job taken = job(task, entries_[r.first + r.head]);
  r.head = (r.head + 1) % r.depth;
  --r.count;
  return taken;
}

Job UnreadSamples::peek(TaskId task, std::uint32_t i) const {
  const Reader& r = readers_[task];
  assert(i < r.count);
  return job(task, entries_[r.first + (r.head + i) % r.depth]);
}

}  // namespace hotpath
