// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/schedule_check.hpp"

#include <iterator>
#include <sstream>

namespace hotpath {

namespace {

/// Prints a record for messages. Instants are relative to the epoch, in ns.
class Described {
 public:
  Described(const TaskSet& set, Time epoch, const JobRecord& r) : set_(set), epoch_(epoch), r_(r) {}

  friend std::ostream& operator<<(std::ostream& out, const Described& d) {
    const JobRecord& r = d.r_;
    out << d.set_[r.job.task].name << " #" << r.job.sequence << " (" << to_string(r.outcome);
    if (started(r)) out << ", worker " << r.worker << " of process " << r.process;
    out << ", timestamp " << d.since_epoch(r.job.timestamp);
    if (started(r))
      out << ", release " << d.since_epoch(r.job.release) << ", start " << d.since_epoch(r.start);
    if (r.outcome == Outcome::ran) out << ", finish " << d.since_epoch(r.finish);
    return out << ")";
  }

 private:
  std::int64_t since_epoch(Time t) const { return (t - epoch_).count(); }
  const TaskSet& set_;
  const Time epoch_;
  const JobRecord& r_;
};

std::string sentence(const auto&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

}  // namespace

ScheduleCheck::ScheduleCheck(const TaskSet& set, Time epoch, Time end, bool live)
    : set_(set), epoch_(epoch), end_(end), live_(live), tasks_(set.size()), last_start_(epoch) {}

bool ScheduleCheck::in_order(TaskId id) const {
  return set_.groups[set_[id].group] == CallbackGroup::mutually_exclusive;
}

std::string ScheduleCheck::add(const JobRecord& r) {
  if (r.outcome == Outcome::empty) return {};  // its sample has its own record
  std::string problem = account(r);
  if (problem.empty() && started(r)) problem = check_instants(r);
  if (problem.empty() && started(r)) problem = check_order(r);
  return problem;
}

/// Checks that no sequence occurs twice and that a timer's timestamps match its period and phase.
std::string ScheduleCheck::account(const JobRecord& r) {
  const Described job(set_, epoch_, r);
  const Task& task = set_[r.job.task];
  TaskState& state = tasks_[r.job.task];
  const std::uint64_t beyond = r.job.sequence + 1 + r.job.skipped;
  const auto next = state.later.lower_bound(r.job.sequence);
  if (r.job.sequence < state.accounted || (next != state.later.end() && next->first < beyond) ||
      (next != state.later.begin() && std::prev(next)->second > r.job.sequence)) {
    return sentence(job, " occurs twice");
  }
  state.later.emplace(r.job.sequence, beyond);
  for (auto first = state.later.begin(); first != state.later.end() && first->first == state.accounted;
       first = state.later.erase(first)) {
    state.accounted = first->second;
  }
  if (task.kind != TaskKind::timer) return {};
  const Duration since_first = r.job.timestamp - epoch_ - task.phase;
  const auto periods = static_cast<std::uint64_t>(since_first / task.period);
  if (since_first % task.period == Duration{} && periods == r.job.sequence) return {};
  return sentence(job, " is not ", r.job.sequence, " periods of ", task.period.count(),
                  " ns after its first timestamp, ", task.phase.count());
}

std::string ScheduleCheck::check_instants(const JobRecord& r) const {
  const Described job(set_, epoch_, r);
  if (r.job.release < r.job.timestamp) return sentence(job, " is released before its timestamp");
  if (r.start < r.job.release) return sentence(job, " starts before its release");
  const bool decided_before_the_end = live_ && r.outcome == Outcome::running && r.job.release < end_;
  if (r.start >= end_ && !decided_before_the_end) {
    return sentence(job, " starts after the end of the run, ", (end_ - epoch_).count());
  }
  if (r.outcome == Outcome::ran && r.finish < r.start) return sentence(job, " ends before it starts");
  return {};
}

std::string ScheduleCheck::check_order(const JobRecord& r) {
  const Described job(set_, epoch_, r);
  if (r.start < last_start_) return sentence(job, " is not in the order of starts");
  last_start_ = r.start;
  Time& free = worker_free_[{r.process, r.worker}];
  if (r.start < free) return sentence(job, " starts while its worker is busy");
  free = r.outcome == Outcome::ran ? r.finish : Time::max();
  if (!in_order(r.job.task)) return {};
  TaskState& state = tasks_[r.job.task];
  if (r.job.sequence < state.next_start) return sentence(job, " starts after a later job of its task");
  state.next_start = r.job.sequence + 1 + r.job.skipped;
  const TaskId parent = r.job.parent.task;
  if (parent == kNoTask || !in_order(parent)) return {};
  Time& published = state.published.try_emplace(parent, epoch_).first->second;
  if (r.job.timestamp < published) {
    return sentence(job, " follows a sample that ", set_[parent].name, " published later");
  }
  published = r.job.timestamp;
  return {};
}

std::string ScheduleCheck::lost(const std::vector<std::uint64_t>& expected) const {
  for (TaskId id = 0; id < set_.size(); ++id) {
    const TaskState& state = tasks_[id];
    if (state.accounted == expected[id] && state.later.empty()) continue;
    const char* const unit = set_[id].kind == TaskKind::timer ? " timestamps" : " samples";
    if (state.accounted < expected[id]) {
      return sentence(set_[id].name, " #", state.accounted, " is lost, of ", expected[id], unit, " in total");
    }
    return sentence(set_[id].name, " has rows for more than its ", expected[id], unit);
  }
  return {};
}

}  // namespace hotpath
