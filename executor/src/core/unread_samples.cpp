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

std::optional<Job> UnreadSamples::add(TaskId task, const SampleInfo& sample) {
  const auto replaced = samples_.push(task, {arrived_[task]++, sample});
  return replaced ? std::optional(job(task, *replaced)) : std::nullopt;
}

}  // namespace hotpath
