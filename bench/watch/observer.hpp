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
#include <tuple>
#include <utility>
#include <vector>

#include "hotpath/tracing/assembler.hpp"
#include "import/chain_follower.hpp"
#include "program/latency_histogram.hpp"
#include "watch/callback_check.hpp"
#include "watch/flight_recorder.hpp"
#include "watch/job_times.hpp"
#include "watch/thread_check.hpp"

namespace hotpath::watch {

/// What was observed of a chain since the beginning.
struct ObservedChain {
  /// Of each output, a job of a sink that ended with data of the sources: start of the latest source's job
  /// to the start of the sink's.
  program::LatencyHistogram hot_path;
  program::LatencyHistogram age;  ///< Timestamp of the oldest source's job to the end of the sink's.
};

/// Follows the data of a contract's chains through the jobs of a running system.
class ChainCheck {
 public:
  /// Both must outlive it.
  ChainCheck(const StatedNames& names, Judge& judge)
      : contract_(names.contract),
        judge_(judge),
        jobs_(contract_.callbacks.size()),
        observed_(contract_.chains.size()),
        join_(chains_of_tasks(), static_cast<TaskId>(jobs_.size()), kRemembered),
        follower_(rules(names), [this](const ChainObservation& o) { pending_.push_back(o); }) {}
  ChainCheck(const ChainCheck&) = delete;
  ChainCheck& operator=(const ChainCheck&) = delete;

  // In the order of time.
  /// `entry`: the job's callback in the contract; `publisher`: that of its sample, kNone: unknown.
  void started(std::uint32_t entry, const tracing::Job& job, std::uint32_t publisher,
               std::optional<Time> timestamp) {
    const JobRef ref{entry, jobs_[entry]++};
    if (timestamp) join_.add_start({.job = {ref.task, ref.sequence, *timestamp}});
    std::optional<imports::ChainFollower::Taken> taken;
    if (publisher != tracing::kNone && taken_[entry] != tracing::kNone)
      taken = {job.sample.parent, publisher, taken_[entry]};
    follower_.start(job.ref, ref, job.start, taken);
  }
  /// `topic`: its number among the stated ones.
  void published(const tracing::Job& job, std::uint32_t topic) { follower_.publish(job.ref, topic); }
  /// `judged`: whether the outputs of the job are compared with the contract.
  void ended(const tracing::Job& job, bool judged) {
    const std::optional<JobRef> ref = follower_.end(job.ref, job.ended);
    if (ref && job.ended) join_.add_end({.job = {ref->task, ref->sequence}, .finish = job.finish});
    std::erase_if(pending_, [&](const ChainObservation& output) {
      const bool of_job = ref && output.sink == *ref;
      if (of_job && job.ended) end(output, judged);
      return of_job;
    });
  }

  /// By chain of the contract.
  [[nodiscard]] const std::vector<ObservedChain>& chains() const { return observed_; }

 private:
  /// Jobs of a task that data may still come from.
  static constexpr std::size_t kRemembered = 4096;

  [[nodiscard]] std::vector<ChainIndex> chains_of_tasks() const {
    std::vector<ChainIndex> chains;
    for (const Group& chain : contract_.chains) chains.push_back({{}, chain.callbacks, 0, chain.sinks});
    return chains;
  }
  imports::ChainFollower::Rules rules(const StatedNames& names) {
    using imports::ChainFollower;
    ChainFollower::Rules rules{.chains = chains_of_tasks(),
                               .held = held_inputs(names),
                               .unread = std::vector<std::size_t>(names.topics().size())};
    std::vector<std::vector<TaskId>> next(contract_.callbacks.size());
    for (TaskId c = 0; c < next.size(); ++c) {
      const CallbackContract& callback = contract_.callbacks[c];
      rules.publishing.push_back(!callback.publishes.empty());
      const std::uint32_t topic = taken_.emplace_back(names.number_of(callback.topic));
      const Term* const depth = find(callback.terms, Clause::depth);
      const auto samples = static_cast<std::uint32_t>(depth ? depth->limit : 0);
      if (topic != tracing::kNone)
        rules.unread[topic] = std::max(rules.unread[topic], ChainFollower::most_unread(samples));
      // Its samples enter its messages, and those of callbacks of its node that publish `with` them.
      std::set<TaskId> with = {c};
      for (const imports::HeldInputs& inputs : rules.held)
        if (std::ranges::count(inputs.of, c) > 0)
          with.insert(inputs.publishers.begin(), inputs.publishers.end());
      for (TaskId from = 0; from < next.size(); ++from)
        if (contract_.callbacks[from].publication(callback.topic))
          next[from].insert(next[from].end(), with.begin(), with.end());
    }
    rules.lanes = ChainLanes(rules.chains, next);
    return rules;
  }
  /// The inputs that enter messages; callbacks of a node that publish by the same set share its samples.
  [[nodiscard]] std::vector<imports::HeldInputs> held_inputs(const StatedNames& names) const {
    const std::vector<CallbackContract>& callbacks = contract_.callbacks;
    std::map<std::tuple<std::string, std::uint32_t, std::vector<std::string>>, imports::HeldInputs> held;
    for (std::uint32_t c = 0; c < callbacks.size(); ++c)
      for (const StatedPublication& p : callbacks[c].publishes)
        if (!p.with.empty())
          held[{callbacks[c].node, names.number_of(p.topic), p.with}].publishers.push_back(c);
    std::vector<imports::HeldInputs> rules;
    for (auto& [key, inputs] : held) {
      const auto& [node, topic, with] = key;
      inputs.topic = topic;
      for (std::uint32_t c = 0; c < callbacks.size(); ++c)
        if (callbacks[c].node == node && std::ranges::count(with, callbacks[c].topic) > 0)
          inputs.of.push_back(c);
      rules.push_back(std::move(inputs));
    }
    return rules;
  }
  void end(const ChainObservation& output, bool judged) {
    const ChainRecord joined = join_.join(output);
    ObservedChain& observed = observed_[output.chain];
    Subject& chain = judge_.all(Kind::chain)[output.chain];
    observed.hot_path.add(joined.hot_path_latency);
    chain.seen = chain.seen || judged;
    if (judged) chain.compare(Clause::hot_path, joined.hot_path_latency.count(), output.sink_start);
    const std::optional<Duration> age = joined.latency(Latency::age);
    if (!age) return;
    observed.age.add(*age);
    for (const Clause clause : {Clause::age, Clause::requirement})
      if (judged) chain.compare(clause, age->count(), joined.finish);
  }

  const Contract& contract_;
  Judge& judge_;
  std::vector<std::uint32_t> taken_;       // by entry: the stated topic that it takes; kNone: none
  std::vector<std::uint64_t> jobs_;        // by entry: number of the next job
  std::vector<ChainObservation> pending_;  // of jobs that have not ended
  std::vector<ObservedChain> observed_;
  ChainJoin join_;
  imports::ChainFollower follower_;
};

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
      e.number[2] -= static_cast<std::uint64_t>(judge_.incidents().realtime.count());
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
    Incidents& incidents = judge_.incidents();
    const Duration step = offset - incidents.realtime;
    const char* const way = step > Duration{} ? "forward" : "back";
    if (callback_check_.begun() && std::chrono::abs(step) >= kStep)
      incidents.add({Role::clock, at,
                     program::concat("the clock was set ", way, " by ", shown_ms(std::chrono::abs(step)))});
    incidents.realtime = offset;
  }
  /// Adds waits and jobs to new incidents, and to those of which something else broke first, as soon as the
  /// threads have been read after their beginning, or `at_end`. Returns these incidents.
  std::vector<Incident*> describe(bool at_end) {
    std::vector<Incident*> news;
    for (Incident& incident : judge_.incidents().kept) {
      const Fact& first = incident.first();
      const bool read = contract_.threads.empty() || thread_check_.at() >= first.at;
      if (incident.is_described() || (!read && !at_end)) continue;
      const bool tells_job = first.term != nullptr && first.term->clause() == Clause::budget;
      const std::vector<Fact> waits = thread_check_.waits(first.since, first.until);
      std::vector<Fact> meanwhile = jobs(first.since, first.until, tells_job ? first.term->subject() : "");
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
  [[nodiscard]] Judge& judge() { return judge_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  static constexpr std::uint32_t kNone = tracing::kNone;
  /// Of a system: further descriptions of entities are ignored.
  static constexpr std::uint64_t kMostEntities = 200'000;
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
  ChainCheck chain_check_{names_, judge_};
  ThreadCheck thread_check_{names_, judge_};
  CallbackCheck callback_check_{names_, judge_, thread_check_};
  Timestamps timestamps_;
  std::vector<CallbackObservation> callbacks_;
  std::uint64_t events_ = 0;
  std::set<std::uint32_t> unstamped_;  // processes whose publications have no source timestamps
  std::deque<PastJob> past_jobs_;      // of all callbacks, in the order of their ends
  /// By subscription: overwritten, but not lost unless it takes a later sample: it may have been destroyed.
  std::map<std::uint32_t, std::vector<tracing::LostSample>> unsure_;
};

}  // namespace hotpath::watch
