// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/tracing/assembler.hpp"
#include "watch/callback_check.hpp"
#include "watch/chain_check.hpp"
#include "watch/flight_recorder.hpp"
#include "watch/job_times.hpp"
#include "watch/thread_check.hpp"

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
           std::optional<Time> attached = std::nullopt)
      : contract_(std::move(contract)),
        recorder_(recorder),
        judge_(contract_, names_.topics(), realtime),
        timestamps_(attached) {}
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// The next event in the order of time.
  void event(tracing::Event e) {
    ++events_;
    if (e.kind == tracing::EventKind::rmw_publish && e.number[2] == 0) unstamped_.insert(e.process);
    if (e.kind == tracing::EventKind::rmw_take &&
        unstamped_.contains(e.process))  // the clock of publications
      e.number[2] -= static_cast<std::uint64_t>(judge_.incidents().realtime().count());
    if (e.kind == tracing::EventKind::wait_for_work) timestamps_.waits({e.process, e.thread}, e.at);
    if (recorder_ != nullptr) recorder_->keep(e);
    assembler_.event(e);
  }
  /// Events that were lost so far, until this instant, before those that follow are passed. For some
  /// seconds after a loss, the absence of events shows nothing.
  void note_losses(std::uint64_t losses, Time until) { callback_check_.note_losses(losses, until); }
  /// All events before this instant were passed, except those that were lost so far: judges what has not
  /// happened.
  void observed_until(Time until, std::uint64_t losses) { callback_check_.observed_until(until, losses); }
  /// Facts of the system's threads, some times a second.
  void threads(const std::vector<ThreadFacts>& facts, Time at) { thread_check_.facts(facts, at); }
  /// A thread that has ended; id 0: a process with all of its threads. `broke_off`: not by itself.
  void forget(const ThreadKey& ended, bool broke_off = true) {
    thread_check_.forget(ended);
    if (ended.second != 0) {
      assembler_.forget_thread(ended.first, ended.second);
      timestamps_.forget(ended);
    } else {
      assembler_.forget_process(ended.first);
      callback_check_.forget(ended.first, broke_off);
    }
  }
  /// Programs begin to end: from now on the absence of events shows nothing.
  void end() { callback_check_.end(); }
  /// The real-time clock minus that of Time, from this instant on. Humble's samples are matched by it.
  void set_realtime(Duration offset, Time at) {
    constexpr Duration kStep = std::chrono::milliseconds(50);  // time servers slew it by less
    const Duration step = offset - judge_.incidents().realtime();
    if (callback_check_.begun() && std::chrono::abs(step) >= kStep)
      judge_.incidents().add({Role::clock, at,
                              std::string("the clock was set ") + (step > Duration{} ? "forward" : "back") +
                                  " by " + shown_ms(std::chrono::abs(step))});
    judge_.incidents().set_realtime(offset);
  }
  /// Adds waits and jobs to new incidents, and to those of which something else broke first, as soon as the
  /// threads have been read after their beginning, or `at_end`. Returns these incidents.
  std::vector<Incident*> describe(bool at_end) {
    std::vector<Incident*> news;
    for (Incident& incident : judge_.incidents().kept()) {
      const Fact& first = incident.first();
      const bool read = contract_.threads.empty() || thread_check_.at() >= first.at;
      if (incident.is_described() || (!read && !at_end)) continue;
      const bool tells_job = first.term != nullptr && first.term->clause() == Clause::budget;
      std::vector<Fact> meanwhile = jobs(first.since, first.until, tells_job ? first.term->subject() : "");
      const std::vector<Fact> waits = thread_check_.waits(first.since, first.until);
      meanwhile.insert(meanwhile.end(), waits.begin(), waits.end());
      incident.describe(meanwhile);
      news.push_back(&incident);
    }
    return news;
  }

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
  static constexpr std::uint32_t kNone = tracing::kNone;
  /// Of a system: further descriptions of entities are ignored.
  static constexpr std::uint64_t kMostEntities = 200'000;
  /// A job that has ended.
  struct PastJob {
    std::uint32_t callback;  ///< Of the system.
    Time start{}, finish{};
  };

  void started(const tracing::Job& job) override {
    const ThreadKey thread = key_of(system().threads[job.thread]);
    const auto timestamp = timestamps_.start(job, system().callbacks[job.ref.callback], thread);
    const std::uint32_t entry = names_.entry_of(job.ref.callback);
    thread_check_.started(job, entry);
    if (job.has_sample) confirm_losses(job.ref.callback);
    const bool traced = entry != kNone && job.has_sample && job.sample.parent.callback != kNone;
    const std::uint32_t publisher = traced ? names_.entry_of(job.sample.parent.callback) : kNone;
    if (entry != kNone) chain_check_.started(entry, job, publisher, timestamp);
    callback_check_.started(job, entry, timestamp);
  }
  void published(const tracing::Job& job, const tracing::Publication& p) override {
    const std::uint32_t topic = names_.number_of(p.topic);
    if (topic == kNone) return;
    const std::uint32_t entry = names_.entry_of(job.ref.callback);
    const std::string& name = names_.topics()[topic];
    const StatedPublication* const known =
        entry == kNone ? nullptr : contract_.callbacks[entry].publication(name);
    JudgedTerm* const publishes = entry == kNone ? nullptr : judge_.callback(entry).find(Clause::publishes);
    const auto messages = std::ranges::count(job.published, p.topic, &tracing::Publication::topic);
    if (publishes == nullptr && !known) {
      const std::string node = node_name(system(), system().callbacks[job.ref.callback].node);
      judge_.publishers(topic).judge(false, "is also published by " + node, p.at);
    } else if (publishes != nullptr && known && (messages == 1 || known->several)) {
      publishes->hold();
    } else if (publishes != nullptr) {
      publishes->judge(false,
                       known ? program::concat("published ", messages, " messages of ", name, " in one job")
                             : "published " + name + ", which the contract lacks",
                       p.at);
    }
    if (entry != kNone) chain_check_.published(job, topic);
  }
  void ended(tracing::Job&& job) override {
    timestamps_.end(job, key_of(system().threads[job.thread]));
    const std::uint32_t entry = names_.entry_of(job.ref.callback);
    const RunningJob ran = callback_check_.ended(job, entry);
    if (job.ended) {
      CallbackObservation& observed = of(job.ref.callback);
      observed.execution.add(job.finish - job.start);
      if (ran.timestamp) observed.response.add(job.finish - *ran.timestamp);
      remember(job);
    }
    if (entry != kNone) chain_check_.ended(job, callback_check_.knows(job));
  }
  void lost(const tracing::LostSample& sample) override {
    constexpr std::size_t kMost = 1'000;
    if (std::vector<tracing::LostSample>& unsure = unsure_[sample.subscription];
        !sample.queued && unsure.size() < kMost)
      unsure.push_back(sample);
  }
  /// The subscription takes a sample.
  void confirm_losses(std::uint32_t callback) {
    if (const auto samples = unsure_.extract(callback)) {
      for (const tracing::LostSample& sample : samples.mapped()) {
        ++of(callback).lost;
        callback_check_.lost(sample);
      }
    }
  }
  CallbackObservation& of(std::uint32_t callback) {
    if (callback >= callbacks_.size()) callbacks_.resize(callback + 1);
    return callbacks_[callback];
  }
  void remember(const tracing::Job& job) {
    constexpr Duration kLength = std::chrono::seconds(5);
    constexpr std::size_t kMost = 10'000;
    past_jobs_.push_back({job.ref.callback, job.start, job.finish});
    while (past_jobs_.size() > kMost || past_jobs_.front().finish + kLength < job.finish)
      past_jobs_.pop_front();
  }
  /// The longest jobs from `since` until then, except those of the callback.
  [[nodiscard]] std::vector<Fact> jobs(Time since, Time until, const std::string& except) {
    constexpr std::size_t kMostShown = 5;
    std::vector<PastJob> meanwhile;
    for (const PastJob& job : past_jobs_)
      if (job.finish > since && job.start < until) meanwhile.push_back(job);
    std::ranges::stable_sort(meanwhile, std::greater(), [](const PastJob& j) { return j.finish - j.start; });
    std::vector<Fact> facts;
    for (const PastJob& job : meanwhile) {
      if (facts.size() == kMostShown) break;
      const std::uint32_t entry = names_.entry_of(job.callback);
      const std::string name = entry == kNone ? callback_name(system(), system().callbacks[job.callback])
                                              : judge_.callback(entry).name;
      if (name == except) continue;
      facts.push_back({Role::circumstance, job.finish, name + " ran " + shown_ms(job.finish - job.start)});
    }
    return facts;
  }

  const Contract contract_;
  FlightRecorder* const recorder_;
  tracing::Assembler assembler_{*this, kMostEntities};
  StatedNames names_{contract_, system()};
  Judge judge_;
  ChainCheck chain_check_{contract_, names_, judge_};
  ThreadCheck thread_check_{contract_, system(), judge_};
  CallbackCheck callback_check_{contract_, system(), names_, judge_, thread_check_};
  Timestamps timestamps_;
  std::vector<CallbackObservation> callbacks_;
  std::uint64_t events_ = 0;
  std::set<std::uint32_t> unstamped_;  // processes whose publications have no source timestamps
  std::deque<PastJob> past_jobs_;      // of all callbacks, in the order of their ends
  /// By subscription: overwritten, but not lost unless it takes a later sample: it may have been destroyed.
  std::map<std::uint32_t, std::vector<tracing::LostSample>> unsure_;
};

}  // namespace hotpath::watch
