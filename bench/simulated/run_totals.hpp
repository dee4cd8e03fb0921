// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <vector>

#include "hotpath/core/job_sink.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "results/summary.hpp"

namespace hotpath {

/// What a summary needs of a simulation whose jobs are not kept. Its size does not depend on the number of
/// jobs.
class RunTotals final : public JobSink {
 public:
  RunTotals(const TaskSet& set, const std::vector<MeasuredChain>& chains, Time counted_from);

  void started(const JobRecord& record) override;
  void ended(const JobRecord& record) override;

  /// Fills in the counts of accounts whose expected numbers are known.
  void count(std::vector<TaskAccount>& accounts) const;
  /// Whether the sink's job belongs to the warm-up.
  bool early(JobRef sink) const { return early_.count({sink.task, sink.sequence}) != 0; }
  /// Adds response times and deadline overruns to a summary of this run's executor.
  void add_to(ExecutorSummary& summary) const;

 private:
  struct OfTask {
    TaskAccount account;
    TimerCounts counts;
    std::uint64_t responses = 0;
    Duration least = Duration::max(), most{};
    double sum_ms = 0;
  };
  const TaskSet& set_;
  const Time counted_from_;
  std::vector<bool> is_sink_;
  std::vector<OfTask> of_task_;
  std::set<std::pair<TaskId, std::uint64_t>> early_;
};

}  // namespace hotpath
