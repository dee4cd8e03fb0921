// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath::page {

/// An interval since the epoch of a repetition.
using Interval = std::pair<Time, Time>;

/// Started jobs of one repetition, one column of integers per property. Columns hold differences
/// where these are small numbers, which compress well.
class JobColumns {
 public:
  explicit JobColumns(TaskId tasks) : last_sequence_(tasks, 0) {}

  /// Adds a job, in order of start.
  void add(const JobRecord& job);
  [[nodiscard]] std::size_t size() const { return task_.size(); }

  /// By property; bench/hotpath_report/web/README.md explains them.
  [[nodiscard]] nlohmann::json columns() const;

 private:
  using Column = std::vector<std::int64_t>;
  Column task_, sequence_, start_, length_, timestamp_, release_, worker_, parent_, parent_sequence_;
  std::vector<std::uint64_t> last_sequence_;  // by task
  Time last_start_{};
};

}  // namespace hotpath::page
