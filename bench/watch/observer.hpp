// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/tracing/assembler.hpp"
#include "program/latency_histogram.hpp"
#include "watch/contract_check.hpp"
#include "watch/flight_recorder.hpp"
#include "watch/running_jobs.hpp"

namespace hotpath::watch {

/// What was observed of one callback since the beginning.
struct CallbackObservation {
  std::uint64_t lost = 0;               ///< Samples that were overwritten unread.
  program::LatencyHistogram execution;  ///< Of each job, start to end, including preemption.
  program::LatencyHistogram response;   ///< Timestamp to end, where the timestamp is known.
  std::optional<Timer> timer = {};      ///< Timers: their nominal instants.
  Time created{};                       ///< Of that timer.
};

/// Assembles the events of running programs, and keeps statistics of each callback. Memory is bounded
/// by the number of callbacks and threads.
class Observer : public tracing::Sink {
 public:
  /// Passes jobs on to the contract and events to the recorder, which outlive it; nullptr: none.
  /// `attached`: the jobs before this instant are unknown.
  Observer(ContractCheck* contract, FlightRecorder* recorder, std::optional<Time> attached = std::nullopt)
      : contract_(contract), recorder_(recorder), attached_(attached) {}

  /// The next event in the order of time.
  void event(tracing::Event e);

  /// The real-time clock minus that of Time. Humble's samples are matched by it.
  void set_realtime(Duration offset) { realtime_ = offset; }

  /// All events before this instant were passed, except those that were lost so far.
  void observed_until(Time until, const Losses& losses);

  /// A thread that has ended; id 0: a process with all of its threads.
  void forget(const ThreadKey& thread) {
    if (contract_ != nullptr) contract_->forget(thread);
    if (thread.second == 0) return assembler_.forget_process(thread.first);
    assembler_.forget_thread(thread.first, thread.second);
    rounds_.erase(thread);
  }

  [[nodiscard]] const tracing::System& system() const { return assembler_.system(); }
  /// By callback of the system.
  [[nodiscard]] std::vector<CallbackObservation>& callbacks() { return callbacks_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }
  /// Descriptions of entities that were not added, because a system has less than kMostEntities.
  [[nodiscard]] std::uint64_t ignored() const { return system().ignored; }

  static constexpr std::uint64_t kMostEntities = 200'000;

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
  void started(const tracing::Job& job) override;
  void published(const tracing::Job& job, const tracing::Publication& publication) override;
  void ended(tracing::Job&& job) override;
  void lost(const tracing::LostSample& sample) override;
  CallbackObservation& of(std::uint32_t callback);
  /// Timestamp of the job; std::nullopt: unknown.
  std::optional<Time> timestamp_of(const tracing::Job& job, const tracing::Callback& callback,
                                   CallbackObservation& observed) const;
  /// Whether a timer was due at `due` although its job starts more than a period later, and not reset
  /// since then; std::nullopt: unknown.
  std::optional<bool> is_late(const tracing::Job& job, Time due, Duration period) const;

  ContractCheck* const contract_;
  FlightRecorder* const recorder_;
  const std::optional<Time> attached_;
  tracing::Assembler assembler_{*this, kMostEntities};
  std::vector<CallbackObservation> callbacks_;
  RunningJobs running_;
  std::map<ThreadKey, Rounds> rounds_;
  std::uint64_t events_ = 0;
  Duration realtime_{};
  std::set<std::uint32_t> unstamped_;  // processes whose publications have no source timestamps
};

}  // namespace hotpath::watch
