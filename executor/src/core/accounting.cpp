// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/accounting.hpp"

namespace hotpath {

std::uint64_t TaskAccount::accounted() const {
  const TaskAccount& self = *this;
  return self[Outcome::ran] + self[Outcome::skipped] + self[Outcome::overwritten] + self[Outcome::queued] +
         self[Outcome::running];
}

std::vector<TaskAccount> account(const TaskSet& set, const Trace& trace) {
  std::vector<TaskAccount> accounts(set.size());
  for (TaskId id = 0; id < set.size(); ++id) {
    accounts[id].task = id;
    const Task& task = set[id];
    if (task.kind == TaskKind::timer) {
      const Time first = trace.epoch + task.phase;
      if (first < trace.end) {
        accounts[id].expected =
            1 + static_cast<std::uint64_t>((trace.end - Duration(1) - first) / task.period);
      }
    }
    if (id < trace.published.size()) accounts[id].expected += trace.published[id];
  }
  for (const JobRecord& r : trace.jobs) {
    TaskAccount& a = accounts[r.job.task];
    ++a.count[static_cast<std::size_t>(r.outcome)];
    a.count[static_cast<std::size_t>(Outcome::skipped)] += r.job.skipped;
  }
  return accounts;
}

}  // namespace hotpath
