// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/schedule_check.hpp"

#include <iterator>
#include <sstream>

namespace hotpath {

/// Instants are relative to the epoch, in ns.
std::string ScheduleCheck::problem(const JobRecord& r, const auto&... parts) const {
  const auto since_epoch = [this](Time t) { return (t - epoch_).count(); };
  std::ostringstream out;
  out << set_[r.job.task].name << " #" << r.job.sequence << " (" << to_string(r.outcome);
  if (r.started()) out << ", worker " << r.worker << " of process " << r.process;
  out << ", timestamp " << since_epoch(r.job.timestamp);
  if (r.started()) out << ", release " << since_epoch(r.job.release) << ", start " << since_epoch(r.start);
  if (r.outcome == Outcome::ran) out << ", finish " << since_epoch(r.finish);
  return concat(out.str(), ")", parts...);
}

ScheduleCheck::ScheduleCheck(const TaskSet& set, Time epoch, Time end, bool live)
    : set_(set), epoch_(epoch), end_(end), live_(live), tasks_(set.size()), last_start_(epoch) {}

std::string ScheduleCheck::add(const JobRecord& r) {
  if (r.outcome == Outcome::empty) return {};  // its sample has its own record
  std::string message = account(r);
  if (message.empty() && r.started()) message = check_instants(r);
  if (message.empty() && r.started()) message = check_order(r);
  return message;
}

/// Checks that no sequence occurs twice and that a timer's timestamps match its period and phase.
std::string ScheduleCheck::account(const JobRecord& r) {
  const Task& task = set_[r.job.task];
  TaskState& state = tasks_[r.job.task];
  const std::uint64_t beyond = r.job.sequence + 1 + r.job.skipped;
  const auto next = state.later.lower_bound(r.job.sequence);
  if (r.job.sequence < state.accounted || (next != state.later.end() && next->first < beyond) ||
      (next != state.later.begin() && std::prev(next)->second > r.job.sequence)) {
    return problem(r, " occurs twice");
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
  return problem(r, " is not ", r.job.sequence, " periods of ", task.period.count(),
                 " ns after its first timestamp, ", task.phase.count());
}

std::string ScheduleCheck::check_instants(const JobRecord& r) const {
  if (r.job.release < r.job.timestamp) return problem(r, " is released before its timestamp");
  if (r.start < r.job.release) return problem(r, " starts before its release");
  const bool decided_before_the_end = live_ && r.outcome == Outcome::running && r.job.release < end_;
  if (r.start >= end_ && !decided_before_the_end) {
    return problem(r, " starts after the end of the run, ", (end_ - epoch_).count());
  }
  if (r.outcome == Outcome::ran && r.finish < r.start) return problem(r, " ends before it starts");
  return {};
}

std::string ScheduleCheck::check_order(const JobRecord& r) {
  if (r.start < last_start_) return problem(r, " is not in the order of starts");
  last_start_ = r.start;
  Time& free = worker_free_[{r.process, r.worker}];
  if (r.start < free) return problem(r, " starts while its worker is busy");
  free = r.outcome == Outcome::ran ? r.finish : Time::max();
  if (!in_order(r.job.task)) return {};
  TaskState& state = tasks_[r.job.task];
  if (r.job.sequence < state.next_start) return problem(r, " starts after a later job of its task");
  state.next_start = r.job.sequence + 1 + r.job.skipped;
  const TaskId parent = r.job.parent.task;
  if (parent == kNoTask || !in_order(parent)) return {};
  Time& published = state.published.try_emplace(parent, epoch_).first->second;
  if (r.job.timestamp < published) {
    return problem(r, " follows a sample that ", set_[parent].name, " published later");
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
      return concat(set_[id].name, " #", state.accounted, " is lost, of ", expected[id], unit, " in total");
    }
    return concat(set_[id].name, " has rows for more than its ", expected[id], unit);
  }
  return {};
}

}  // namespace hotpath
