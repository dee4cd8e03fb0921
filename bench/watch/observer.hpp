// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/tracing/assembler.hpp"
#include "watch/chain_check.hpp"
#include "watch/flight_recorder.hpp"
#include "watch/judge.hpp"
#include "watch/running_jobs.hpp"
#include "watch/thread_check.hpp"
#include "watch/timestamps.hpp"

namespace hotpath::watch {

/// What was observed of one callback since the beginning.
struct CallbackObservation {
  std::uint64_t lost = 0;               ///< Samples that were overwritten unread.
  program::LatencyHistogram execution;  ///< Of each job, start to end, including preemption.
  program::LatencyHistogram response;   ///< Timestamp to end, where the timestamp is known.
};

/// Assembles the events of running programs, keeps statistics of each callback, and compares jobs, chains,
/// threads and publishers with a contract. Memory is bounded by the number of callbacks and threads.
class Observer : public tracing::Sink {
 public:
  /// An empty contract states nothing. The recorder outlives it; nullptr: none. `realtime`: as for
  /// set_realtime(). `attached`: the jobs before this instant are unknown.
  Observer(Contract contract, FlightRecorder* recorder, Duration realtime = {},
           std::optional<Time> attached = std::nullopt);
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// The next event in the order of time.
  void event(tracing::Event e);
  /// Events that were lost so far, until this instant, before those that follow are passed. For some
  /// seconds after a loss, the absence of events shows nothing.
  void note_losses(std::uint64_t losses, Time until);
  /// All events before this instant were passed, except those that were lost so far: judges what has not
  /// happened.
  void observed_until(Time until, std::uint64_t losses);
  /// Facts of the system's threads, some times a second.
  void threads(const std::vector<ThreadFacts>& facts, Time at) { thread_check_.facts(facts, at); }
  /// A thread that has ended; id 0: a process with all of its threads. `broke_off`: not by itself.
  void forget(const ThreadKey& ended, bool broke_off = true);
  /// Programs begin to end: from now on the absence of events shows nothing.
  void end() {
    ending_ = true;
    lossless_ = false;
  }
  /// The real-time clock minus that of Time, from this instant on. Humble's samples are matched by it.
  void set_realtime(Duration offset, Time at);
  /// Adds waits and jobs to new incidents, and to those of which something else broke first, as soon as the
  /// threads have been read after their beginning, or `at_end`. Returns these incidents.
  std::vector<Incident*> describe(bool at_end);

  [[nodiscard]] const tracing::System& system() const { return assembler_.system(); }
  [[nodiscard]] const Contract& contract() const { return contract_; }
  /// By callback of the system.
  [[nodiscard]] const std::vector<CallbackObservation>& callbacks() const { return callbacks_; }
  /// By chain of the contract.
  [[nodiscard]] const std::vector<ObservedChain>& chains() const { return chain_check_.chains(); }
  /// The name of the executor that a thread belongs to; empty: unknown.
  [[nodiscard]] std::string executor_of(const ThreadKey& thread) const {
    return thread_check_.name_of(thread);
  }
  [[nodiscard]] const Judge& judge() const { return judge_; }
  [[nodiscard]] Judge& judge() { return judge_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  /// Of a system: further descriptions of entities are ignored.
  static constexpr std::uint64_t kMostEntities = 200'000;
  struct CallbackState {
    std::uint32_t callback = 0;  ///< Of the system, the one that was seen last.
    std::optional<Time> last;    ///< Timers: start; subscriptions: publication of a sample.
    std::optional<Time> silent;  ///< Until when it was reported that nothing follows `silent_since`.
    Time silent_since{};
    std::deque<tracing::Sample> samples;  ///< The latest ones.
    bool watched = false;                 ///< A sample came from a watched job.
    std::uint64_t lost = 0;
    std::optional<Time> waited_for;  ///< Since when its samples have been published without a job.
    bool stands = false;             ///< That it does not run was reported.
  };
  /// A job that has ended.
  struct PastJob {
    std::uint32_t callback;  ///< Of the system.
    Time start{}, finish{};
  };
  /// A process that ran callbacks of the contract.
  struct Process {
    std::set<std::string> nodes = {};
    Time finish{};                   ///< Of its latest job.
    std::optional<Time> ended = {};  ///< When it was seen to have ended.
    bool broke_off = false;
  };

  void started(const tracing::Job& job) override;
  void published(const tracing::Job& job, const tracing::Publication& publication) override;
  void ended(tracing::Job&& job) override;
  void lost(const tracing::LostSample& sample) override;
  CallbackObservation& of(std::uint32_t callback);
  void judge_start(std::uint32_t entry, const tracing::Job& job);
  void arrived(std::uint32_t entry, Time at);
  void arrived(std::uint32_t entry, std::uint32_t callback, const tracing::Sample& sample);
  void remember(const tracing::Job& job);
  void judge_run(std::uint32_t entry, const tracing::Job& job, const RunningJob& ran);
  void judge_publisher(std::uint32_t topic, bool known, const std::string& observed, Time at);
  [[nodiscard]] std::vector<Fact> jobs(Time since, Time until, const std::string& except);

  // What has not happened.
  /// Whether the end of a job that started then may be among lost events.
  [[nodiscard]] bool is_doubtful(Time start) const { return lost_at_ && start <= *lost_at_; }
  void judge_running(Time until);
  void judge_silence(std::uint32_t entry, Time until);
  void judge_processes(Time until);
  void judge_standing(Time until);
  void judge_standing(std::uint32_t entry, std::uint32_t callback, Time until);
  [[nodiscard]] bool could_run(const tracing::Callback& callback, Time since) const;
  [[nodiscard]] std::vector<std::uint32_t> nodes_of(std::uint32_t entry) const;
  [[nodiscard]] bool runs(std::uint32_t entry) const;
  [[nodiscard]] std::pair<Role, std::string> absence(std::uint32_t entry, std::uint32_t callback);
  void confirm_losses(std::uint32_t callback);
  void judge_lost(const tracing::LostSample& sample);
  void judge_created_publishers(Time until);

  const Contract contract_;
  FlightRecorder* const recorder_;
  tracing::Assembler assembler_{*this, kMostEntities};
  StatedNames names_{contract_, system()};
  Judge judge_;
  ChainCheck chain_check_{contract_, names_, judge_};
  ThreadCheck thread_check_{contract_, system(), judge_};
  Timestamps timestamps_;
  RunningJobs running_;
  std::vector<CallbackObservation> callbacks_;
  std::uint64_t events_ = 0;
  std::set<std::uint32_t> unstamped_;           // processes whose publications have no source timestamps
  std::vector<CallbackState> states_;           // by entry
  std::vector<bool> judged_endpoints_;          // of the system
  std::deque<PastJob> past_jobs_;               // of all callbacks, in the order of their ends
  std::map<std::uint32_t, Process> processes_;  // by id
  /// By subscription: overwritten, but not lost unless it takes a later sample: it may have been destroyed.
  std::map<std::uint32_t, std::vector<tracing::LostSample>> unsure_;
  std::optional<Time> begin_, observed_until_;
  Time grown_{};  // when a node was created, or a callback of the contract ran first
  std::size_t nodes_ = 0;
  std::uint64_t losses_ = 0;
  std::optional<Time> lost_at_;  // the latest loss
  bool lossless_ = true;         // lately
  bool ending_ = false;
};

}  // namespace hotpath::watch
