// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/tracing/system.hpp"

namespace hotpath::watch {

/// A job that has started.
struct RunningJob {
  tracing::JobRef ref;
  std::uint32_t thread = 0;
  std::int32_t processor = -1;
  Time start{};
  std::optional<Time> timestamp = {};  ///< std::nullopt: unknown.
  Duration displaced{};                ///< By jobs of other threads that have ended.
  std::optional<Time> overdue = {};    ///< Since when, without the jobs that displaced it.
  Duration judged{};                   ///< Its length when it was found to be overdue.
};

/// The jobs that have started and not ended, of all threads. A job that starts on the processor of
/// another thread's job displaces it.
class RunningJobs {
 public:
  void start(const tracing::Job& job, std::optional<Time> timestamp) {
    jobs_.push_back({job.ref, job.thread, job.processor, job.start, timestamp});
  }

  /// Ends a job; of one that is unknown, nothing is known. By what it was displaced is unknown, too, if it
  /// changed its processor.
  RunningJob end(const tracing::Job& job) {
    const auto at = std::ranges::find(jobs_, job.ref, &RunningJob::ref);
    if (at == jobs_.end()) return {};
    RunningJob ended = *at;
    jobs_.erase(at);
    if (!job.ended || job.processor != ended.processor) {
      ended.displaced = {};
      return ended;
    }
    for (RunningJob& other : jobs_)
      if (displaces(ended, other)) other.displaced += job.finish - ended.start - ended.displaced;
    return ended;
  }

  /// Since when a running job would have run without other jobs; std::nullopt: one displaces it now.
  [[nodiscard]] std::optional<Time> undisplaced_start(const RunningJob& job) const {
    if (std::ranges::any_of(jobs_, [&](const RunningJob& other) { return displaces(other, job); }))
      return std::nullopt;
    return job.start + job.displaced;
  }

  /// In the order of their starts.
  [[nodiscard]] std::vector<RunningJob>& all() { return jobs_; }
  [[nodiscard]] const std::vector<RunningJob>& all() const { return jobs_; }

 private:
  static bool displaces(const RunningJob& job, const RunningJob& other) {
    return job.processor >= 0 && job.processor == other.processor && job.thread != other.thread &&
           job.start >= other.start;
  }

  std::vector<RunningJob> jobs_;
};

}  // namespace hotpath::watch
