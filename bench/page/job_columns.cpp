// SPDX-License-Identifier: Apache-2.0
#include "page/job_columns.hpp"

#include <nlohmann/json.hpp>

namespace hotpath::page {

void JobColumns::add(const JobRecord& r) {
  const auto difference = [](std::uint64_t a, std::uint64_t b) { return static_cast<std::int64_t>(a - b); };
  const bool finished = r.outcome == Outcome::ran;
  const bool published = r.job.parent.task != kNoTask;
  std::uint64_t& last = last_sequence_[r.job.task];
  task_.push_back(r.job.task);
  sequence_.push_back(difference(r.job.sequence, last));
  start_.push_back((r.start - last_start_).count());
  length_.push_back(finished ? (r.finish - r.start).count() : -1);
  timestamp_.push_back((r.start - r.job.timestamp).count());
  release_.push_back((r.start - r.job.release).count());
  worker_.push_back(r.worker);
  parent_.push_back(published ? static_cast<std::int64_t>(r.job.parent.task) : -1);
  parent_sequence_.push_back(published ? difference(r.job.sequence, r.job.parent.sequence) : 0);
  last = r.job.sequence;
  last_start_ = r.start;
}

nlohmann::json JobColumns::columns() const {
  return {{"task", task_},
          {"sequence", sequence_},
          {"start", start_},
          {"length", length_},
          {"before_timestamp", timestamp_},
          {"before_release", release_},
          {"worker", worker_},
          {"parent", parent_},
          {"parent_sequence", parent_sequence_}};
}

}  // namespace hotpath::page
