// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Checks invariants that hold for the records of every run, under any executor, live or simulated.
/// Records are passed one at a time; the records of started jobs come in the order of their starts.
/// Memory grows with the number of tasks and workers and with records that arrive out of sequence,
/// not with the number of records.
class ScheduleCheck {
 public:
  /// `set` has the phases of the run and must outlive the check. No job starts at or after `end`.
  /// In a live run `end` may have been brought forward between a decision and the start of its job;
  /// that job is `running`.
  ScheduleCheck(const TaskSet& set, Time epoch, Time end, bool live);

  /// The problem of the next record, as a complete message; empty if there is none.
  [[nodiscard]] std::string add(const JobRecord& r);

  /// To be called after the last record: reports lost jobs; empty if there are none. `expected` is,
  /// by task, the number of timestamps or samples (TaskAccount::expected).
  [[nodiscard]] std::string lost(const std::vector<std::uint64_t>& expected) const;

 private:
  struct TaskState {
    std::uint64_t accounted = 0;  ///< All lower sequences have a record.
    /// Higher sequences with a record, as ranges: first to one past the last.
    std::map<std::uint64_t, std::uint64_t> later{};
    std::uint64_t next_start = 0;        ///< The smallest sequence that may start.
    std::map<TaskId, Time> published{};  ///< By publishing task: timestamp of the last started sample.
  };

  /// A message about a record.
  std::string problem(const JobRecord& r, const auto&... parts) const;
  std::string account(const JobRecord& r);
  std::string check_instants(const JobRecord& r) const;
  std::string check_order(const JobRecord& r);
  [[nodiscard]] bool in_order(TaskId id) const {
    return set_.groups[set_[id].group] == CallbackGroup::mutually_exclusive;
  }

  const TaskSet& set_;
  const Time epoch_, end_;
  const bool live_;
  std::vector<TaskState> tasks_;
  std::map<std::pair<std::uint16_t, std::uint16_t>, Time> worker_free_;  // by process and worker
  Time last_start_{};
};

}  // namespace hotpath
