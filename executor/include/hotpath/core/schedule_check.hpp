// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// What must hold of the records of one run, whatever executor it had, live or simulated. Records come one
/// after another, those that started in the order of their starts. Memory is needed for tasks and workers,
/// and for records that come in another order than their sequences, not for the records themselves.
class ScheduleCheck {
 public:
  /// `set` has the phases of the run and outlives the check. No job starts at or after `end`; in a live run
  /// it may have been brought forward between a decision and the start of its job, which is `running` then.
  ScheduleCheck(const TaskSet& set, Time epoch, Time end, bool live);

  /// What is wrong with the next record, a whole sentence's worth; empty: nothing.
  [[nodiscard]] std::string add(const JobRecord& r);

  /// After the last record: what got lost, where `expected` is, by task, the number of its timestamps or
  /// samples (TaskAccount::expected). Empty: nothing.
  [[nodiscard]] std::string lost(const std::vector<std::uint64_t>& expected) const;

 private:
  struct TaskState {
    std::uint64_t accounted = 0;  ///< All sequences below it have had their record.
    /// Above it, those that have had theirs: from the first to beyond the last.
    std::map<std::uint64_t, std::uint64_t> later{};
    std::uint64_t next_start = 0;        ///< The least sequence that may start.
    std::map<TaskId, Time> published{};  ///< By publishing task: timestamp of the last sample that started.
  };

  std::string account(const JobRecord& r);
  std::string check_instants(const JobRecord& r) const;
  std::string check_order(const JobRecord& r);
  [[nodiscard]] bool in_order(TaskId id) const;

  const TaskSet& set_;
  const Time epoch_, end_;
  const bool live_;
  std::vector<TaskState> tasks_;
  std::map<std::pair<std::uint16_t, std::uint16_t>, Time> worker_free_;  // by process and worker
  Time last_start_{};
};

}  // namespace hotpath
