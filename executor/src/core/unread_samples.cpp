// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/unread_samples.hpp"

namespace hotpath {

Job UnreadSamples::job(TaskId task, const Entry& e) {
  Job job;
  job.task = task;
  job.sequence = e.sequence;
  job.timestamp = e.sample.published;
  job.deadline = e.sample.deadline;
  job.parent = e.sample.parent;
  return job;
}

UnreadSamples::Added UnreadSamples::add(TaskId task, const SampleInfo& sample) {
  const Entry entry{arrived_[task]++, sample};
  Added added;
  if (const auto replaced = samples_.push(task, entry)) added.overwritten = job(task, *replaced);
  added.job = job(task, entry);
  return added;
}

}  // namespace hotpath
