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
  /// Follows each started(), also for a job whose end was lost.
  void ended(const tracing::System& system, const tracing::Job& job);
  /// Facts of the system's threads. They cover the time since the previous ones.
  void facts(const std::vector<ThreadFacts>& facts, Time at, Incidents& incidents);

  /// Of the latest facts.
  [[nodiscard]] std::optional<Time> at() const { return at_; }
  [[nodiscard]] const std::vector<Subject>& subjects() const { return subjects_; }
  /// When the hypervisor's counter of withheld time of a thread's processor was last seen to grow.
  [[nodiscard]] std::optional<Time> withheld() const { return withheld_; }
  /// The name of the thread's executor; empty: unknown.
  [[nodiscard]] std::string name_of(const ThreadKey& thread) const;

 private:
  /// What a thread waited, and what it ran beside its jobs, from its first reading until another one.
  struct Reading {
    Time at{};
    Duration waited{}, stolen{};
    Duration ran_aside{};    ///< What it ran, without the lengths of its jobs: less by what these waited.
    std::uint64_t jobs = 0;  ///< That ended.
    bool idle = true;        ///< No job runs, so that Linux has counted all that the thread ran.
  };
  using Readings = std::deque<Reading>;
  /// Jobs of a thread; those of executors that spin in a job are part of it.
  struct Work {
    std::uint32_t open = 0;                        ///< That have not ended.
    Time since{};                                  ///< The start of the first of these.
    std::deque<std::pair<Time, Time>> ended = {};  ///< After the latest reading.
  };
  /// A thread that ran a job.
  struct State {
    Time first_start{};                      ///< Of a job of its executor, if it has one.
    std::uint32_t owner = tracing::kNone;    ///< Its executor; kNone: none, or several.
    std::optional<ThreadFacts> before = {};  ///< The previous facts.
    Readings readings = {};                  ///< The latest ones.
    Work work = {};
    Time judged = {};  ///< Before this instant, waits were counted as too long.
  };
  /// At the shortest distance of facts, five seconds.
  static constexpr std::size_t kMostReadings = 256;
  /// Between two readings.
  static constexpr std::size_t kMostJobs = 10'000;
  /// A thread without facts for as long as this has ended before any were read.
  static constexpr Duration kForgotten = std::chrono::seconds(10);

  void judge(Subject& subject, const ThreadFacts& now, const State& state, Incidents& incidents) const;
  void note_wait(const ThreadFacts& now, State& state);
  void judge_wait(JudgedTerm& wait, State& state, Incidents& incidents) const;
  [[nodiscard]] static std::string sentence(const JudgedTerm& wait, const State& state, const Reading& from,
                                            const Reading& to);
  static void note_work(Work& work, Time since, Reading& now);
  [[nodiscard]] static std::optional<Duration> most_waited_in_jobs(const Readings& readings,
                                                                   Readings::const_iterator from,
                                                                   Readings::const_iterator to);
  void explain(JudgedTerm& wait, State& state, Incidents& incidents) const;
  [[nodiscard]] bool may_explain(const Breach& breach, const State& state) const;
  void forget(const std::vector<ThreadFacts>& facts);

  std::vector<Subject> subjects_;                      // as in the contract
  std::vector<std::uint32_t> of_entry_;                // by callback of the contract: its threads
  std::map<std::string, std::uint32_t> of_timer_;      // the same, by the timer's name
  std::map<std::uint32_t, std::uint32_t> of_process_;  // kNone: of several executors
  std::map<ThreadKey, State> states_;
  std::optional<Time> previous_, at_, withheld_;
};

}  // namespace hotpath::watch
