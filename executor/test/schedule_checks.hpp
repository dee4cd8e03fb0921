// SPDX-License-Identifier: Apache-2.0
// Invariants of any schedule. Each check returns a description of the violation, or an empty
// string.
#pragma once

#include <map>
#include <set>
#include <sstream>

#include "hotpath/core/accounting.hpp"
#include "hotpath/core/schedule_check.hpp"
#include "task_sets.hpp"

namespace hotpath::test {

/// The instant until which a started job occupied its worker.
inline Time busy_until(const JobRecord& r, const Trace& trace) {
  return r.outcome == Outcome::ran ? r.finish : trace.end;
}

inline std::string describe(const JobRecord& r) {
  std::ostringstream out;
  out << "task " << r.job.task << " #" << r.job.sequence << " (" << to_string(r.outcome) << ", worker "
      << int{r.worker} << ", timestamp " << to_ns(r.job.timestamp) << ", release " << to_ns(r.job.release)
      << ", start " << to_ns(r.start) << ", finish " << to_ns(r.finish) << ")";
  return out.str();
}

/// The result of ScheduleCheck for the records. The end of a live run may have been brought
/// forward.
inline std::string legal(const TaskSet& set, const Trace& trace, bool live = false) {
  ScheduleCheck check(set, trace.epoch, trace.end, live);
  for (const JobRecord& r : trace.jobs) {
    if (std::string wrong = check.add(r); !wrong.empty()) return wrong;
  }
  return {};
}

inline std::string balanced(const TaskSet& set, const Trace& trace) {
  for (const TaskAccount& a : account(set, trace)) {
    if (!a.balanced()) {
      return "task " + std::to_string(a.task) + ": " + std::to_string(a.accounted()) + " accounted of " +
             std::to_string(a.expected);
    }
  }
  return {};
}

/// No two jobs of a mutually exclusive callback group overlap.
inline std::string groups_exclusive(const TaskSet& set, const Trace& trace) {
  std::map<std::uint32_t, Time> group_free;
  for (const JobRecord& r : trace.jobs) {
    if (!r.started()) continue;
    const std::uint32_t group = set[r.job.task].group;
    if (set.groups[group] != CallbackGroup::mutually_exclusive) continue;
    if (r.start < group_free[group]) return "its group is busy: " + describe(r);
    group_free[group] = busy_until(r, trace);
  }
  return {};
}

/// While a job waits (from its timestamp to its start, or to the end), at least `busy_workers`
/// workers run jobs all the time. The platform must have no costs, so that no time passes between
/// two jobs of a worker.
inline std::string work_conserving(const Trace& trace, std::size_t busy_workers) {
  std::map<Time, int> change;  // number of running jobs
  for (const JobRecord& r : trace.jobs) {
    if (!r.started()) continue;
    ++change[r.start];
    --change[busy_until(r, trace)];
  }
  std::vector<std::pair<Time, int>> running;  // number from that instant on
  running.reserve(change.size());
  int now_running = 0;
  for (const auto& [t, by] : change) running.emplace_back(t, now_running += by);
  for (const JobRecord& r : trace.jobs) {
    if (!r.started() && r.outcome != Outcome::queued) continue;
    const Time waits_until = r.started() ? r.start : trace.end;
    if (r.job.timestamp >= waits_until) continue;
    auto from = std::upper_bound(running.begin(), running.end(), r.job.timestamp,
                                 [](Time t, const auto& entry) { return t < entry.first; });
    if (from == running.begin()) return "nothing runs while this waits: " + describe(r);
    for (--from; from != running.end() && from->first < waits_until; ++from) {
      if (from->second < static_cast<int>(busy_workers)) {
        return "a worker idles at " + std::to_string(to_ns(from->first)) +
               " while this waits: " + describe(r);
      }
    }
  }
  return {};
}

/// Priority of a job under a policy, smaller first, without ties: implemented from the paper's
/// text, independently of the library's priority order. `upstream[task]` are the timers from which
/// samples reach a subscription.
class PriorityByTheBook {
 public:
  PriorityByTheBook(const TaskSet& set, const std::string& policy) : set_(set), policy_(policy) {
    upstream_.resize(set.size());
    for (bool changed = true; changed;) {
      changed = false;
      for (TaskId id = 0; id < set.size(); ++id) {
        std::set<TaskId> own = upstream_[id];
        if (set[id].kind == TaskKind::timer) own.insert(id);
        for (const TaskId fed : set[id].feeds) {
          const std::size_t before = upstream_[fed].size();
          upstream_[fed].insert(own.begin(), own.end());
          changed |= upstream_[fed].size() != before;
        }
      }
    }
  }

  std::int64_t of(const Job& job) const {
    if (policy_ == "edf") return to_ns(job.deadline);
    const Task& task = set_[job.task];
    if (task.kind == TaskKind::timer) return own(task);
    if (policy_ == "fp" && task.priority) return *task.priority;
    std::int64_t highest = std::numeric_limits<std::int64_t>::max();
    for (const TaskId timer : upstream_[job.task]) highest = std::min(highest, own(set_[timer]));
    return highest;
  }

 private:
  std::int64_t own(const Task& timer) const {
    if (policy_ == "rm") return timer.period.count();
    if (policy_ == "dm") return timer.deadline.count();
    return timer.priority.value_or(std::numeric_limits<std::int64_t>::max());
  }
  const TaskSet& set_;
  const std::string policy_;
  std::vector<std::set<TaskId>> upstream_;
};

/// Per worker: no job starts while a released job of higher priority waits, and at most one job of
/// lower priority executes between the release and the start of a job.
inline std::string priority_driven(const Trace& trace, const PriorityByTheBook& priority,
                                   const std::vector<int>& worker_of_task) {
  struct Entry {
    const JobRecord* record;
    std::int64_t priority;
    Time waits_until;
  };
  std::map<int, std::vector<Entry>> by_worker;
  for (const JobRecord& r : trace.jobs) {
    if (r.started() && r.worker != worker_of_task[r.job.task]) return "on the wrong worker: " + describe(r);
    if (!r.started() && (r.outcome != Outcome::queued || r.job.release < r.job.timestamp)) continue;
    by_worker[worker_of_task[r.job.task]].push_back(
        {&r, priority.of(r.job), r.started() ? r.start : trace.end});
  }
  for (const auto& [worker, entries] : by_worker) {
    for (const Entry& waiting : entries) {
      int lower = 0;
      for (const Entry& other : entries) {
        if (!other.record->started() || other.priority <= waiting.priority) continue;
        const Time start = other.record->start;
        if (waiting.record->job.release <= start && start < waiting.waits_until) {
          return describe(*other.record) + " starts before " + describe(*waiting.record);
        }
        if (start < waiting.waits_until && busy_until(*other.record, trace) > waiting.record->job.release) {
          ++lower;
        }
      }
      if (lower > 1) return std::to_string(lower) + " jobs block " + describe(*waiting.record);
    }
  }
  return {};
}

}  // namespace hotpath::test
