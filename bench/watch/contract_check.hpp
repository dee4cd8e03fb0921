// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "program/text_table.hpp"
#include "watch/chain_check.hpp"
#include "watch/judged_term.hpp"
#include "watch/publisher_check.hpp"
#include "watch/running_jobs.hpp"
#include "watch/session.hpp"
#include "watch/thread_check.hpp"

namespace hotpath::watch {

/// Compares the jobs, chains, threads and publishers of a running system with a contract.
class ContractCheck {
 public:
  /// `realtime`: the real-time clock minus that of Time.
  ContractCheck(Contract contract, Duration realtime);
  ContractCheck(const ContractCheck&) = delete;
  ContractCheck& operator=(const ContractCheck&) = delete;

  // In the order of time; `timestamp`: of the job, where it is known; `ran`: what is known of its run.
  void started(const tracing::System& system, const tracing::Job& job, std::optional<Time> timestamp);
  void published(const tracing::System& system, const tracing::Job& job, const tracing::Publication& p);
  /// Also of a job whose end was lost.
  void ended(const tracing::System& system, const tracing::Job& job, const RunningJob& ran);
  /// An unread sample was overwritten.
  void lost(const tracing::System& system, const tracing::LostSample& sample);
  /// Events that were lost so far, until this instant, before those that follow are passed. For some
  /// seconds after a loss, the absence of events shows nothing.
  void note_losses(std::uint64_t losses, Time until);
  /// A thread that has ended; id 0: a process with all of its threads.
  void forget(const ThreadKey& ended);
  /// All events before this instant were passed: judges what has not happened. `running`: the jobs that have
  /// not ended; `losses`: as for note_losses().
  void observed_until(const tracing::System& system, RunningJobs& running, Time until, std::uint64_t losses);
  /// Programs begin to end: from now on the absence of events shows nothing.
  void end() {
    ending_ = true;
    lossless_ = false;
    gone_.clear();
  }
  /// Facts of the system's threads, some times a second.
  void threads(const std::vector<ThreadFacts>& facts, Time at) { thread_check_.facts(facts, at, incidents_); }
  /// From now on.
  void set_realtime(Duration offset) { incidents_.set_realtime(offset); }

  /// Whether any term is broken.
  [[nodiscard]] bool broken() const { return incidents_.count() > 0; }
  /// The first one and the latest ones.
  [[nodiscard]] std::deque<Incident>& incidents() { return incidents_.kept(); }
  /// Adds waits and jobs to new incidents, as soon as the threads have been read after their beginning, or
  /// `at_end`.
  void describe(const tracing::System& system, bool at_end);
  /// What broke first in the first incident; empty: there is none.
  [[nodiscard]] std::string incident() const { return broken() ? incidents_.kept().front().text() : ""; }
  /// Lost events make terms that are not broken unobservable.
  [[nodiscard]] program::TextTable table(const Losses& losses) const;
  [[nodiscard]] nlohmann::json json(const Losses& losses) const;

  [[nodiscard]] const Contract& contract() const { return contract_; }
  /// By chain of the contract.
  [[nodiscard]] std::vector<ObservedChain>& chains() { return chain_check_.chains(); }
  /// The name of the executor that a thread belongs to; empty: unknown.
  [[nodiscard]] std::string executor_of(const ThreadKey& thread) const {
    return thread_check_.name_of(thread);
  }
  /// Index of the contract's entry for a callback of the system; kNone: none.
  std::uint32_t entry_of(const tracing::System& system, std::uint32_t callback);

 private:
  struct CallbackState {
    std::uint32_t callback = 0;  ///< Of the system, the one that was seen last.
    std::optional<Time> last;    ///< Timers: start; subscriptions: publication of a sample.
    std::optional<Time> silent;  ///< Until when it was reported that nothing follows `silent_since`.
    Time silent_since{};
    std::deque<tracing::Sample> samples;  ///< The latest ones.
    bool watched = false;                 ///< A sample came from a watched job.
    std::uint64_t lost = 0;
    std::optional<Time> waited_for;  ///< Never run: since when its samples have been published.
    bool never_ran = false;          ///< That was reported.
  };
  /// A job that has ended.
  struct PastJob {
    std::uint32_t callback;  ///< Of the system.
    Time start{}, finish{};
  };
  /// A process that ran callbacks of the contract.
  struct Process {
    std::uint32_t entry = 0;  ///< Of the first one.
    Time finish{};            ///< Of its latest job.
    Time noticed{};           ///< When it was seen to have ended.
  };
  struct Verdict {
    const Subject& subject;
    const JudgedTerm& term;
    const char* word;  ///< held, broken, not observable
    std::string reason;
  };

  [[nodiscard]] std::uint32_t find_entry(const tracing::System& system, std::uint32_t callback) const;
  /// The entry of a timer that a new one of its node replaces: of those with the same period that ran
  /// before the creation, and not since, the one that has been silent longest. kNone: there is none.
  [[nodiscard]] std::uint32_t replaced_timer(const std::string& node, std::uint32_t number,
                                             const tracing::Callback& by) const;
  void arrived(std::uint32_t entry, Time at);
  void arrived(const tracing::System& system, std::uint32_t entry, std::uint32_t callback,
               const tracing::Sample& sample);
  /// Whether the end of a job that started then may be among lost events.
  [[nodiscard]] bool is_doubtful(Time start) const { return lost_at_ && start <= *lost_at_; }
  void remember(const tracing::System& system, const tracing::Job& job);
  void judge(const ChainOutput& output);
  void judge_running(const tracing::System& system, RunningJobs& running, Time until);
  void judge_silence(const tracing::System& system, std::uint32_t entry, Time until);
  /// Processes that have ended while others go on.
  void judge_processes(Time until);
  /// Callbacks that have never run, although they are due, or samples are published for them.
  void judge_never_run(const tracing::System& system, Time until);
  /// The longest jobs from `since` until then, except those of the callback.
  [[nodiscard]] std::vector<Fact> jobs(const tracing::System& system, Time since, Time until,
                                       const std::string& except);
  [[nodiscard]] Verdict verdict(const Subject& subject, const JudgedTerm& term, const Losses& losses) const;
  [[nodiscard]] std::vector<Verdict> verdicts(const Losses& losses) const;

  const Contract contract_;
  Incidents incidents_;
  std::vector<Subject> subjects_;  // callbacks, then chains, as in the contract
  std::vector<CallbackState> states_;
  std::vector<std::optional<std::uint32_t>> entries_;  // by callback of the system
  StatedNames names_;
  std::uint64_t changes_ = 0;  // of the namespace, that the entries are for
  ChainCheck chain_check_;
  ThreadCheck thread_check_;
  PublisherCheck publisher_check_;
  std::deque<PastJob> past_jobs_;               // of all callbacks, in the order of their ends
  std::map<std::uint32_t, Process> processes_;  // by id
  std::vector<Process> gone_;
  std::optional<Time> begin_, observed_until_, searched_;
  std::uint64_t losses_ = 0;
  std::optional<Time> lost_at_;  // the latest loss
  bool lossless_ = true;         // lately
  bool ending_ = false;
};

}  // namespace hotpath::watch
