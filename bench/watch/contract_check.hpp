// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
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
  ContractCheck(Contract contract, const WallClock& clock);
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
  /// All events before this instant were passed: judges what has not happened. `running`: the jobs that have
  /// not ended; `losses`: as for note_losses().
  void observed_until(const tracing::System& system, RunningJobs& running, Time until, std::uint64_t losses);
  /// Programs begin to end: from now on the absence of events shows nothing.
  void end() {
    ending_ = true;
    lossless_ = false;
  }
  /// Facts of the system's threads, some times a second.
  void threads(const std::vector<ThreadFacts>& facts, Time at) { thread_check_.facts(facts, at, incidents_); }
  /// From `from` on, instants are shown by this clock.
  void follow(const WallClock& clock, Time from) { clock_.follow(clock, from); }

  /// Whether any term is broken.
  [[nodiscard]] bool broken() const { return incidents_.count() > 0; }
  [[nodiscard]] const Incidents& incidents() const { return incidents_; }
  /// Whether the facts of threads can no longer show an earlier cause of an incident.
  [[nodiscard]] bool settled(const Incident& incident) const;
  /// The first broken assumption and the first exceeded bound of an incident, in one sentence.
  [[nodiscard]] std::string text(const Incident& incident, const Losses& losses) const;
  /// The same of the first incident; empty: there is none.
  [[nodiscard]] std::string incident(const Losses& losses) const;
  /// `text`: of the incident.
  [[nodiscard]] nlohmann::json json(const Incident& incident, const std::string& text) const;
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
  /// A chain as option of `hotpath import ctf --chain`.
  [[nodiscard]] std::string imported_chain(const std::string& name) const;
  /// Index of the contract's entry for a callback of the system; kNone: none.
  std::uint32_t entry_of(const tracing::System& system, std::uint32_t callback);
  /// The largest share of a limit that a callback or chain of the contract has reached; above 1 if it
  /// is broken, -1: unknown.
  [[nodiscard]] double nearness_of_callback(std::uint32_t entry) const { return subjects_[entry].nearness(); }
  [[nodiscard]] double nearness_of_chain(std::uint32_t chain) const {
    return subjects_[contract_.callbacks.size() + chain].nearness();
  }

 private:
  struct CallbackState {
    std::uint32_t callback = 0;  ///< Of the system, the one that was seen last.
    std::optional<Time> last;    ///< Timers: start; subscriptions: publication of a sample.
    std::optional<Time> silent;  ///< Until when it was reported that nothing follows `silent_since`.
    Time silent_since{};
    std::deque<tracing::Sample> samples;  ///< The latest ones.
    bool watched = false;                 ///< A sample came from a watched job.
    std::uint64_t lost = 0;
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
  void judge(const ChainOutput& output);
  void judge_running(const tracing::System& system, RunningJobs& running, Time until);
  void judge_silence(const tracing::System& system, std::uint32_t entry, Time until);
  [[nodiscard]] Verdict verdict(const Subject& subject, const JudgedTerm& term, const Losses& losses) const;
  [[nodiscard]] std::vector<Verdict> verdicts(const Losses& losses) const;
  /// An assumption that is neither held nor broken, or may have been broken unseen before the incident;
  /// empty: none.
  [[nodiscard]] std::string unseen(const Incident& incident, const Losses& losses) const;

  const Contract contract_;
  WallClock clock_;
  Incidents incidents_;
  std::vector<Subject> subjects_;  // callbacks, then chains, as in the contract
  std::vector<CallbackState> states_;
  std::vector<std::optional<std::uint32_t>> entries_;  // by callback of the system
  StatedNames names_;
  std::uint64_t changes_ = 0;  // of the namespace, that the entries are for
  ChainCheck chain_check_;
  ThreadCheck thread_check_;
  PublisherCheck publisher_check_;
  std::optional<Time> observed_until_;
  std::uint64_t losses_ = 0;
  std::optional<Time> lost_at_;  // the latest loss
  bool lossless_ = true;         // lately
  bool ending_ = false;
};

}  // namespace hotpath::watch
