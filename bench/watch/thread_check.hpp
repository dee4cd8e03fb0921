// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "watch/judged_term.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// Compares the threads that run callbacks with those of a contract. A thread belongs to the
/// executor whose callbacks it runs.
class ThreadCheck {
 public:
  explicit ThreadCheck(const Contract& contract);

  /// A job starts. `entry`: its callback in the contract; kNone: none.
  void started(const tracing::System& system, const tracing::Job& job, std::uint32_t entry,
               Incident& incident);
  /// By thread of the system.
  void facts(const std::vector<std::optional<ThreadFacts>>& facts, Time at, Incident& incident);

  /// Of the latest facts.
  [[nodiscard]] std::optional<Time> at() const { return at_; }
  [[nodiscard]] const std::vector<Subject>& subjects() const { return subjects_; }
  [[nodiscard]] std::string name_of(std::uint32_t thread) const;

 private:
  /// Between two facts of a thread, or from its first job to its first facts, whose counts began
  /// earlier (not exact).
  struct Interval {
    Time begin{}, end{};
    bool exact = true;
  };
  static void judge(Subject& subject, const ThreadFacts& now, const ThreadFacts& before,
                    const Interval& interval, Incident& incident);
  static void judge_wait(Subject& subject, const ThreadFacts& now, const ThreadFacts& before,
                         const Interval& interval, Incident& incident);

  std::vector<Subject> subjects_;         // as in the contract
  std::vector<std::uint32_t> of_entry_;   // by callback of the contract: its threads
  std::vector<std::uint32_t> of_thread_;  // by thread of the system: the same
  std::vector<Time> first_starts_;        // by thread of the system: of a job of the executor
  std::vector<std::optional<ThreadFacts>> before_;
  std::optional<Time> previous_, at_;
};

}  // namespace hotpath::watch
