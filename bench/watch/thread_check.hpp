// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "watch/judge.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// Compares the threads that run callbacks with those of a contract. A thread belongs to the
/// executor whose callbacks it runs, a timer thread to the only executor of its process.
class ThreadCheck {
 public:
  /// The system and the judge must outlive it.
  ThreadCheck(const Contract& contract, const tracing::System& system, Judge& judge);

  /// A job starts. `entry`: its callback in the contract; kNone: none.
  void started(const tracing::Job& job, std::uint32_t entry);
  /// Facts of the system's threads. They cover the time since the previous ones.
  void facts(const std::vector<ThreadFacts>& facts, Time at);
  /// A thread that has ended; id 0: a process with all of its threads.
  void forget(const ThreadKey& ended);

  /// Of the latest facts.
  [[nodiscard]] std::optional<Time> at() const { return at_; }
  /// The name of the thread's executor; empty: unknown.
  [[nodiscard]] std::string name_of(const ThreadKey& thread) const;
  /// How long threads waited, from the reading before the first instant to the one after the second, unless
  /// that broke a term.
  [[nodiscard]] std::vector<Fact> waits(Time since, Time until) const;

 private:
  /// What a thread waited since its first reading.
  struct Reading {
    Time at{};
    Duration waited{}, stolen{};
  };
  /// A thread that ran a job.
  struct State {
    Time first_start{};                      ///< Of a job of its executor, if it has one.
    Subject* owner = nullptr;                ///< Its executor; nullptr: none, or several.
    std::optional<ThreadFacts> before = {};  ///< The previous facts.
    std::deque<Reading> readings = {};       ///< The latest ones.
    Time judged = {};                        ///< Before this instant, waits were counted as too long.
    std::optional<Time> stands = {};         ///< Since when it has run nothing, although it could.
    bool stood = false;                      ///< That was reported.
  };
  /// At the shortest distance of facts, five seconds.
  static constexpr std::size_t kMostReadings = 256;

  void judge(const ThreadFacts& now, const State& state) const;
  void judge_progress(const ThreadFacts& now, State& state);
  void note_wait(const ThreadFacts& now, State& state) const;
  void judge_wait(State& state) const;
  [[nodiscard]] static std::string sentence(const State& state, const Reading& from, const Reading& to);

  const tracing::System& system_;
  Judge& judge_;
  std::vector<Subject*> of_entry_;                // by callback of the contract: its threads
  std::map<std::uint32_t, Subject*> of_process_;  // nullptr: of several executors
  std::map<ThreadKey, State> states_;
  std::optional<Time> previous_, at_;
};

}  // namespace hotpath::watch
