// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "watch/judged_term.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// Compares the threads that run callbacks with those of a contract. A thread belongs to the
/// executor whose callbacks it runs, a timer thread to the only executor of its process.
class ThreadCheck {
 public:
  explicit ThreadCheck(const Contract& contract);

  /// A job starts. `entry`: its callback in the contract; kNone: none.
  void started(const tracing::System& system, const tracing::Job& job, std::uint32_t entry,
               Incidents& incidents);
  /// Facts of the system's threads. They cover the time since the previous ones.
  void facts(const std::vector<ThreadFacts>& facts, Time at, Incidents& incidents);

  /// Of the latest facts.
  [[nodiscard]] std::optional<Time> at() const { return at_; }
  [[nodiscard]] const std::vector<Subject>& subjects() const { return subjects_; }
  /// The executor of a thread, by its id.
  [[nodiscard]] std::string name_of(std::uint32_t thread) const;

 private:
  /// What a thread waited until an instant.
  struct Waited {
    Time at{};
    Duration waited{}, stolen{};
  };
  /// A thread of an executor.
  struct State {
    Time first_start{};                      ///< Of a job of the executor.
    std::optional<ThreadFacts> before = {};  ///< The previous facts.
    bool exact = false;                      ///< The counts did not begin before `waited`.
    std::deque<Waited> waited = {};          ///< At the latest facts.
  };
  static constexpr std::size_t kMostWaited = 64;

  void judge(Subject& subject, const ThreadFacts& now, const State& state, Incidents& incidents) const;
  void note_wait(const ThreadFacts& now, State& state) const;
  void judge_wait(JudgedTerm& wait, const std::string& name, State& state, Incidents& incidents) const;
  void explain(JudgedTerm& wait, const std::string& name, const State& state, Incidents& incidents) const;
  static void judge_wait(JudgedTerm& wait, const std::string& name, const Waited& from, const Waited& to,
                         Incidents& incidents);

  std::vector<Subject> subjects_;                      // as in the contract
  std::vector<std::uint32_t> of_entry_;                // by callback of the contract: its threads
  std::map<std::uint32_t, std::uint32_t> of_thread_;   // by id of a thread
  std::map<std::uint32_t, std::uint32_t> of_process_;  // kNone: of several executors
  std::map<std::uint32_t, State> states_;              // by id of a thread
  std::optional<Time> previous_, at_;
};

}  // namespace hotpath::watch
