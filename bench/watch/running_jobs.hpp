// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "hotpath/tracing/system.hpp"

namespace hotpath::watch {

/// The jobs that have started and not ended, of all threads. A job that starts on the processor of
/// another thread's job displaces it.
class RunningJobs {
 public:
  void start(const tracing::Job& job) {
    jobs_.push_back({job.ref, job.thread, job.processor, job.start, {}});
  }

  /// Ends a job; returns how long jobs of other threads displaced it. Nothing is known if it changed its
  /// processor.
  Duration end(const tracing::Job& job) {
    const auto at = std::ranges::find_if(jobs_, [&](const Running& r) { return is(r, job.ref); });
    if (at == jobs_.end()) return {};
    const Running ended = *at;
    jobs_.erase(at);
    if (!job.ended || job.processor != ended.processor) return {};
    for (Running& other : jobs_)
      if (displaces(ended, other)) other.displaced += job.finish - ended.start - ended.displaced;
    return ended.displaced;
  }

  /// Since when a job would have run without other jobs; std::nullopt: one displaces it now.
  [[nodiscard]] std::optional<Time> undisplaced_start(const tracing::JobRef& job) const {
    const auto at = std::ranges::find_if(jobs_, [&](const Running& r) { return is(r, job); });
    if (at == jobs_.end() || std::ranges::any_of(jobs_, [&](const Running& r) { return displaces(r, *at); }))
      return std::nullopt;
    return at->start + at->displaced;
  }

 private:
  struct Running {
    tracing::JobRef ref;
    std::uint32_t thread = 0;
    std::int32_t processor = -1;
    Time start{};
    Duration displaced{};
  };
  static bool is(const Running& running, const tracing::JobRef& job) {
    return running.ref.callback == job.callback && running.ref.number == job.number;
  }
  static bool displaces(const Running& job, const Running& other) {
    return job.processor >= 0 && job.processor == other.processor && job.thread != other.thread &&
           job.start >= other.start;
  }

  std::vector<Running> jobs_;
};

}  // namespace hotpath::watch
