// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/accounting.hpp"

namespace hotpath {

std::uint64_t timestamps_in(const Task& timer, Time epoch, Time end) {
  const Time first = epoch + timer.phase;
  return end <= first ? 0 : 1 + static_cast<std::uint64_t>((end - Duration(1) - first) / timer.period);
}

std::vector<std::uint64_t> expected_jobs(const TaskSet& set, const Trace& trace) {
  std::vector<std::uint64_t> expected(set.size());
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) expected[id] = timestamps_in(set[id], trace.epoch, trace.end);
    if (id < trace.published.size()) expected[id] += trace.published[id];
  }
  return expected;
}

std::vector<TaskAccount> account(const TaskSet& set, const Trace& trace) {
  std::vector<TaskAccount> accounts;
  for (const std::uint64_t expected : expected_jobs(set, trace))
    accounts.push_back({.task = static_cast<TaskId>(accounts.size()), .expected = expected});
  for (const JobRecord& r : trace.jobs) accounts[r.job.task].add(r);
  return accounts;
}

}  // namespace hotpath
