// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/tracing/system.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// The timestamps of jobs as they start. Those of timers are derived from creation and period by rcl's
/// rules, unless the executor states them. Memory is bounded by the number of callbacks and threads.
class Timestamps {
 public:
  /// `attached`: the jobs before this instant are unknown.
  explicit Timestamps(std::optional<Time> attached) : attached_(attached) {}

  // In the order of time: the thread waits for work, a job starts, a job ends.
  void waits(const ThreadKey& thread, Time at);
  /// std::nullopt: the timestamp is unknown.
  std::optional<Time> start(const tracing::Job& job, const tracing::Callback& callback,
                            const ThreadKey& thread);
  void end(const tracing::Job& job, const ThreadKey& thread);
  void forget(const ThreadKey& ended) { rounds_.erase(ended); }

 private:
  /// What a thread did since its last two waits for work, or, if it writes no events of waits, since its
  /// last two pauses between jobs. Time{}: unknown.
  struct Rounds {
    bool waits = false;
    std::uint32_t open = 0;                             ///< Jobs that have not ended.
    Time earlier{}, earlier_job{}, last{}, last_job{};  ///< Begin and first job of each.
    Time finish{};                                      ///< Of the latest job.
    void next(Time begin) { *this = {waits, open, last, last_job, begin, {}, finish}; }
  };
  /// The nominal instants of a timer, which was created then.
  struct Nominal {
    Time created{};
    std::optional<Timer> timer = {};
  };
  std::optional<Time> of_timer(const tracing::Job& job, const tracing::Callback& callback,
                               const ThreadKey& thread);
  [[nodiscard]] std::optional<bool> is_late(const ThreadKey& thread, Time due, Duration period) const;

  const std::optional<Time> attached_;
  std::vector<Nominal> timers_;  // by callback
  std::map<ThreadKey, Rounds> rounds_;
};

}  // namespace hotpath::watch
