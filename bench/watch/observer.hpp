// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/tracing/assembler.hpp"
#include "program/latency_histogram.hpp"
#include "watch/contract_check.hpp"
#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

/// What was observed of one callback since the beginning.
struct CallbackObservation {
  std::uint64_t jobs = 0;
  std::uint64_t lost = 0;               ///< Samples that were overwritten unread.
  program::LatencyHistogram execution;  ///< Start to end, including preemption.
  program::LatencyHistogram response;   ///< Timestamp to end, where the timestamp is known.
  std::optional<Timer> timer = {};      ///< Timers: their nominal instants.
  Time created{};                       ///< Of that timer.
  Duration latest{-1};                  ///< Longest execution since next_interval(); -1 ns: none.
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
    if (thread.second == 0) return assembler_.forget_process(thread.first);
    assembler_.forget_thread(thread.first, thread.second);
  }

  /// Forgets the values `latest`.
  void next_interval();

  [[nodiscard]] const tracing::System& system() const { return assembler_.system(); }
  /// By callback of the system.
  [[nodiscard]] const std::vector<CallbackObservation>& callbacks() const { return callbacks_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }
  /// Descriptions of entities that were not added, because a system has less than kMostEntities.
  [[nodiscard]] std::uint64_t ignored() const { return system().ignored; }

  static constexpr std::uint64_t kMostEntities = 200'000;

 private:
  /// The timestamp of a job that has not ended.
  struct Open {
    tracing::JobRef ref;
    std::optional<Time> timestamp;
  };
  void started(const tracing::Job& job) override;
  void published(const tracing::Job& job, const tracing::Publication& publication) override;
  void ended(tracing::Job&& job) override;
  void lost(const tracing::LostSample& sample) override;
  CallbackObservation& of(std::uint32_t callback);
  /// Timestamp of the job; std::nullopt: unknown.
  std::optional<Time> timestamp_of(const tracing::Job& job, const tracing::Callback& callback,
                                   CallbackObservation& observed) const;

  ContractCheck* const contract_;
  FlightRecorder* const recorder_;
  const std::optional<Time> attached_;
  tracing::Assembler assembler_{*this, kMostEntities};
  std::vector<CallbackObservation> callbacks_;
  std::vector<Open> open_;
  std::uint64_t events_ = 0;
  Duration realtime_{};
  std::set<std::uint32_t> unstamped_;  // processes whose publications have no source timestamps
};

}  // namespace hotpath::watch
