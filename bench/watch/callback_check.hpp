// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"
#include "watch/job_times.hpp"
#include "watch/judge.hpp"
#include "watch/stated_names.hpp"
#include "watch/thread_check.hpp"

namespace hotpath::watch {

/// Compares the callbacks and publishers of a running system with those of a contract, also what has not
/// happened: lasting jobs, silence, and callbacks and processes that do not run.
class CallbackCheck {
 public:
  /// All must outlive it.
  CallbackCheck(StatedNames& names, Judge& judge, const ThreadCheck& threads)
      : names_(names), judge_(judge), threads_(threads), states_(contract_.callbacks.size()) {}

  // In the order of time. `entry`: the job's callback in the contract; kNone: none.
  void started(const tracing::Job& job, std::uint32_t entry, std::optional<Time> timestamp) {
    running_.start(job, timestamp);
    if (entry == kNone) return;
    Process& process = processes_[system_.threads[job.thread].process];
    process.nodes.insert(contract_.callbacks[entry].node);
    process.hears = process.hears || comes_from_another(job);
    process.finish = std::max(process.finish, job.start);
    Subject& subject = judge_.callback(entry);
    State& state = states_[entry];
    if (!std::exchange(subject.seen, true)) grown_ = job.start;
    state.waited_for.reset();
    state.stands = false;
    const tracing::Callback& callback = system_.callbacks[job.ref.callback];
    const bool timer = callback.kind == CallbackKind::timer, service = callback.kind == CallbackKind::service;
    if (timer) {
      state.callback = job.ref.callback;
      names_.timer_ran(entry, job.start);
      subject.compare(Clause::period, callback.period.count(), job.start);
    }
    if (!service && callback.depth > 0) subject.compare(Clause::depth, callback.depth, job.start);
    if (timer || service) arrived(entry, job.start);  // no event tells of requests
    if (!timer && !service && job.has_sample) arrived(entry, job.ref.callback, job.sample);
  }
  /// Returns what is known of the job.
  RunningJob ended(const tracing::Job& job, std::uint32_t entry) {
    const RunningJob ran = running_.end(job);
    if (const auto process = processes_.find(system_.threads[job.thread].process);
        job.ended && process != processes_.end())
      process->second.finish = std::max(process->second.finish, job.finish);
    if (entry != kNone && job.ended && !is_doubtful(job.start)) judge_run(entry, job, ran);
    return ran;
  }
  void lost(const tracing::LostSample& sample) {
    const std::uint32_t entry = names_.entry_of(sample.subscription);
    if (entry == kNone || !lossless_ || is_doubtful(sample.sample.published)) return;  // or its take was lost
    if (sample.subscription < states_[entry].callback) return;  // no event tells that this one has ended
    arrived(entry, sample.subscription, sample.sample);
    const auto lost = static_cast<std::int64_t>(++states_[entry].lost);
    judge_.callback(entry).compare(Clause::lost, lost, sample.sample.published);
  }

  // As those of the observer.
  void note_losses(std::uint64_t losses, Time until) {
    if (losses == losses_) return;
    losses_ = losses;
    lost_at_ = until;
    lossless_ = false;
  }
  void observed_until(Time until, std::uint64_t losses) {
    constexpr auto kPause = std::chrono::milliseconds(100);
    constexpr auto kDoubt = std::chrono::seconds(5);
    note_losses(losses, until);
    lossless_ = !ending_ && (!lost_at_ || until > *lost_at_ + kDoubt);
    if (observed_until_ && until < *observed_until_ + kPause) return;
    observed_until_ = until;
    begin_ = begin_.value_or(until);
    judge_processes(until);
    if (lossless_ && names_.kept()) judge_standing(until);
    judge_created_publishers(until);
    judge_running(until);
    // What else the end of a process explains comes after it.
    if (!lossless_ ||
        std::ranges::any_of(processes_, [](const auto& p) { return p.second.ended.has_value(); }))
      return;
    for (std::uint32_t entry = 0; entry < states_.size(); ++entry) judge_silence(entry, until);
  }
  void end() {
    ending_ = true;
    lossless_ = false;
  }
  void forget(std::uint32_t id, bool broke_off) {
    const auto process = processes_.find(id);
    if (process == processes_.end() || process->second.ended) return;
    process->second.ended = observed_until_.value_or(process->second.finish);
    process->second.broke_off = broke_off;
  }

  /// Whether observed_until() has been called.
  [[nodiscard]] bool begun() const { return begin_.has_value(); }
  /// Whether no event of a job that has ended may be lost.
  [[nodiscard]] bool knows(const tracing::Job& job) const {
    return job.ended && lossless_ && !is_doubtful(job.start);
  }

 private:
  static constexpr std::uint32_t kNone = tracing::kNone;
  using CallbackKind = tracing::CallbackKind;

  struct State {
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
  /// A process that ran callbacks of the contract.
  struct Process {
    std::set<std::string> nodes = {};
    Time finish{};                   ///< Of its latest job.
    std::optional<Time> ended = {};  ///< When it was seen to have ended.
    bool broke_off = false;
    bool hears = false;  ///< It has taken a sample of another one: discovery has ended.
  };

  /// Whether the end of a job that started then may be among lost events.
  [[nodiscard]] bool is_doubtful(Time start) const { return lost_at_ && start <= *lost_at_; }
  [[nodiscard]] bool comes_from_another(const tracing::Job& job) const {
    if (!job.has_sample || job.sample.parent.callback == kNone) return false;
    const auto& threads = system_.callbacks[job.sample.parent.callback].threads;
    return !threads.empty() &&
           system_.threads[threads.begin()->first].process != system_.threads[job.thread].process;
  }
  /// A longer absence of jobs or samples is silence: what arrives late is known late.
  static Duration patience(const JudgedTerm& distance) {
    const Duration limit(distance.term().limit);
    return limit + std::min<Duration>(limit, std::chrono::seconds(1));
  }

  /// A timer's job started, or a sample was published.
  void arrived(std::uint32_t entry, Time at) {
    State& state = states_[entry];
    if (state.last && at < *state.last) return;  // published before samples that were taken earlier
    const bool ends_silence = state.silent && at > state.silent_since;
    JudgedTerm* const distance = judge_.callback(entry).find(Clause::maximum_distance);
    if (distance && state.last && lossless_) {
      if (ends_silence) {  // it may have been published before the silence was judged
        distance->judge_ended(state.silent_since, std::max(at, *state.silent) - state.silent_since);
      } else {
        distance->compare((at - *state.last).count(), at);
      }
    }
    state.last = at;
    if (ends_silence) state.silent.reset();
  }
  /// A sample was taken or overwritten.
  void arrived(std::uint32_t entry, std::uint32_t callback, const tracing::Sample& sample) {
    State& state = states_[entry];
    const std::uint32_t topic = names_.number_of(system_.callbacks[callback].topic);
    const bool watched = sample.parent.callback != kNone;
    if (std::exchange(state.callback, callback) != callback) {  // its node was started again
      state.samples.clear();
      state.watched = false;
    }
    if (!watched && state.watched && topic != kNone && lossless_)
      judge_.publishers(topic).judge(
          false, "is also published by a node that is not watched, or outside of callbacks",
          sample.published);
    state.watched = state.watched || watched;
    arrived(entry, sample.published);
    JudgedTerm* const distance = judge_.callback(entry).find(Clause::minimum_distance);
    if (distance == nullptr) return;
    if (!state.samples.empty() && (state.samples.back().sequence + 1 != sample.sequence || !lossless_))
      state.samples.clear();  // another subscription, or unknown ones between them
    std::vector<Duration> distances;
    for (auto before = state.samples.rbegin(); before != state.samples.rend(); ++before)
      distances.push_back(sample.published - before->published);
    distance->compare_distances(distances, sample.published);
    state.samples.push_back(sample);
    if (state.samples.size() > distance->term().further.size() + 1) state.samples.pop_front();
  }
  void judge_run(std::uint32_t entry, const tracing::Job& job, const RunningJob& ran) {
    Subject& subject = judge_.callback(entry);
    const Duration length = job.finish - job.start - ran.displaced;
    if (ran.overdue) {
      subject.find(Clause::budget)->judge_ended(*ran.overdue, std::max(length, ran.judged));
    } else {
      subject.compare(Clause::budget, length.count(), job.finish);
    }
    if (JudgedTerm* const publishes = subject.find(Clause::publishes); publishes && job.published.empty())
      publishes->hold();
    if (ran.timestamp && (lossless_ || job.has_sample))  // a timer's is derived from its earlier jobs
      subject.compare(Clause::response, (job.finish - *ran.timestamp).count(), job.finish);
    const bool service = system_.callbacks[job.ref.callback].kind == CallbackKind::service;
    if (lossless_ && !service && states_[entry].lost == 0) subject.compare(Clause::lost, 0, job.finish);
  }

  void judge_running(Time until) {
    for (RunningJob& job : running_.jobs) {
      const std::uint32_t entry = names_.entry_of(job.ref.callback);
      JudgedTerm* const budget = entry == kNone ? nullptr : judge_.callback(entry).find(Clause::budget);
      if (budget == nullptr || job.overdue || is_doubtful(job.start)) continue;
      const std::optional<Time> start = running_.undisplaced_start(job);
      if (!start || (until - *start).count() <= budget->term().limit) continue;
      job.overdue = start;
      job.judged = until - *start;
      budget->judge_lasting(*start, until);
    }
  }
  void judge_silence(std::uint32_t entry, Time until) {
    State& state = states_[entry];
    JudgedTerm* const distance = judge_.callback(entry).find(Clause::maximum_distance);
    if (distance == nullptr || !state.last || state.silent) return;
    // Samples wait unread while another callback runs, and those of unwatched publishers are known only when
    // they are taken: only what nothing can explain is silence.
    const Time since = std::max(*state.last, system_.callbacks[state.callback].published_for_it);
    if (until - since <= patience(*distance)) return;
    state.silent = until;
    state.silent_since = since;
    distance->judge_lasting(since, until);
  }
  /// Processes that have ended while others go on. At the end of a run, they end one after another, the last
  /// ones by themselves.
  void judge_processes(Time until) {
    constexpr auto kEnding = std::chrono::milliseconds(1500);
    std::erase_if(processes_, [&](const auto& known) {
      const auto& [id, process] = known;
      if (ending_ || !process.ended || until < *process.ended + kEnding) return false;
      const bool others = std::ranges::any_of(processes_, [](const auto& p) { return !p.second.ended; });
      if (!others && !process.broke_off) return true;
      const bool one = process.nodes.size() == 1;
      judge_.incidents().add(
          {Role::gone, process.finish,
           program::concat(one ? "node " : "nodes ", program::joined(process.nodes, ", "),
                           one ? " is gone: its process " : " are gone: their process ", id, " has ended")});
      return true;
    });
  }
  void judge_created_publishers(Time until) {
    judged_endpoints_.resize(system_.endpoints.size());
    for (std::size_t e = 0; names_.kept() && e < system_.endpoints.size(); ++e) {
      const tracing::Endpoint& endpoint = system_.endpoints[e];
      if (judged_endpoints_[e] || endpoint.kind != tracing::Endpoint::Kind::publisher ||
          endpoint.topic == kNone)
        continue;
      judged_endpoints_[e] = true;
      const std::uint32_t topic = names_.number_of(endpoint.topic);
      if (topic == kNone) continue;
      judge_.all(Kind::topic)[topic].seen = true;
      judge_.publishers(topic).judge(
          names_.may_publish(endpoint.node, topic),
          "has a publisher of " + node_name(system_, endpoint.node) + ", which the contract lacks", until);
    }
  }

  /// Callbacks that do not run, although others of the contract do.
  void judge_standing(Time until) {
    if (std::exchange(nodes_, system_.nodes.size()) != system_.nodes.size()) grown_ = until;
    std::vector<std::uint32_t> callbacks(states_.size(), kNone);  // the latest, by entry
    for (std::uint32_t c = 0; c < system_.callbacks.size(); ++c)
      if (const std::uint32_t entry = names_.entry_of(c); entry != kNone) callbacks[entry] = c;
    for (std::uint32_t entry = 0; entry < states_.size(); ++entry)
      if (!states_[entry].stands) judge_standing(entry, callbacks[entry], until);
  }
  void judge_standing(std::uint32_t entry, std::uint32_t c, Time until) {
    constexpr Duration kDoubt = std::chrono::milliseconds(500), kDiscovery = std::chrono::milliseconds(1700),
                       kStart = std::chrono::seconds(10);
    if (!has_events(contract_.callbacks[entry])) return;
    Subject& subject = judge_.callback(entry);
    State& state = states_[entry];
    JudgedTerm* const distance = subject.find(Clause::maximum_distance);
    const tracing::Callback none{}, &callback = c == kNone ? none : system_.callbacks[c];
    if (!state.waited_for && callback.published_for_it > state.last.value_or(Time{}))
      state.waited_for = callback.published_for_it;
    const bool unread = state.waited_for && callback.published_for_it > *state.waited_for;
    // The description of what is missing may be among lost events.
    if (subject.seen ? !unread || !could_run(callback, *state.waited_for)
        : c == kNone ? lost_at_.has_value()
                     : !unread && !distance)
      return;
    const bool timer = callback.kind == CallbackKind::timer;
    const Time first = std::max({callback.created + callback.period, *begin_, grown_});
    const Time since = unread ? *state.waited_for : first;
    Duration limit = kStart;
    const Process* const process = process_of(entry);
    // Before discovery has ended, nothing reaches a callback that is there.
    const bool reached = process && (c == kNone || process->hears || processes_.size() == 1);
    if (distance && (subject.seen || (timer && process)))
      limit = patience(*distance) + kDoubt;
    else if (distance && reached)
      limit = Duration(distance->term().limit) + kDiscovery;
    const Time latest =
        unread && !distance ? callback.published_for_it : until;  // it came late to old samples
    if (latest - since <= limit) return;
    state.stands = true;
    const auto [role, sentence] =
        subject.seen
            ? std::pair(Role::never_runs, subject.name + " has not run for " + shown_ms(until - since) +
                                              ", although samples were published")
            : absence(entry, c);
    Fact fact{role, since, sentence, distance, since, until};
    if (!distance) return judge_.incidents().add(std::move(fact));
    fact.at += Duration(distance->term().limit);
    distance->observe((until - since).count());
    distance->fail(std::move(fact));
  }
  /// Whether events show that it runs: not of clients and actions, nor of what an import adds or never saw.
  static bool has_events(const CallbackContract& stated) {
    return stated.node != imports::kOutside && !stated.topic.ends_with("/response") &&
           stated.topic.find("/_action/") == std::string::npos &&
           std::ranges::any_of(stated.terms, [](const Term& t) { return t.clause != Clause::publishes; });
  }
  /// Whether a thread of the subscription neither stands nor has run one job since then.
  [[nodiscard]] bool could_run(const tracing::Callback& callback, Time since) const {
    return std::ranges::any_of(callback.threads, [&](const auto& jobs) {
      const std::uint32_t thread = jobs.first;
      return !threads_.stands(key_of(system_.threads[thread])) &&
             std::ranges::none_of(running_.jobs, [&](const RunningJob& job) {
               return job.thread == thread && job.start <= since;
             });
    });
  }
  /// Whether the node of the system stands for the entry's.
  [[nodiscard]] bool is_node(std::uint32_t node, std::uint32_t entry) const {
    return node < system_.nodes.size() && names_.stated_node(node) == contract_.callbacks[entry].node;
  }
  /// The process of the entry's node; nullptr: it runs no callbacks of the contract.
  [[nodiscard]] const Process* process_of(std::uint32_t entry) const {
    for (const tracing::Endpoint& e : system_.endpoints) {
      const auto process = processes_.find(e.process);
      if (process != processes_.end() &&
          is_node(e.callback == kNone ? e.node : system_.callbacks[e.callback].node, entry))
        return &process->second;
    }
    return nullptr;
  }
  /// What is known of a callback that has never run, `c` of the system.
  [[nodiscard]] std::pair<Role, std::string> absence(std::uint32_t entry, std::uint32_t c) {
    const CallbackContract& stated = contract_.callbacks[entry];
    const std::string sentence = stated.name() + " has never run";
    std::uint32_t node = 0;
    while (node < system_.nodes.size() && !is_node(node, entry)) ++node;
    if (node == system_.nodes.size())
      return {Role::gone, "node " + stated.node + " is not there, or not watched: " + sentence};
    const bool subscription = !stated.topic.empty() && !stated.service;
    if (c != kNone && !subscription) return {Role::never_runs, sentence};
    if (c != kNone && system_.callbacks[c].samples == 0)
      return {Role::never_runs, sentence + ": nothing was published for it"};
    if (c != kNone)
      return {Role::never_runs, program::concat(sentence, ", although ", system_.callbacks[c].samples,
                                                " samples were published, as if QoS settings did not match")};
    std::string instead;
    for (std::uint32_t o = 0; subscription && o < system_.callbacks.size(); ++o) {
      const tracing::Callback& other = system_.callbacks[o];
      if (other.kind != CallbackKind::subscription || other.topic == kNone || !is_node(other.node, entry) ||
          names_.entry_of(o) != kNone || imports::is_housekeeping(system_.topics[other.topic].name))
        continue;
      instead += (instead.empty() ? ", but subscribes to " : ", ") + system_.topics[other.topic].name;
    }
    return {Role::never_runs, sentence + ": its node has no such callback" + instead};
  }

  StatedNames& names_;
  const Contract& contract_ = names_.contract;
  const tracing::System& system_ = names_.system;
  Judge& judge_;
  const ThreadCheck& threads_;
  RunningJobs running_;
  std::vector<State> states_;                   // by entry
  std::vector<bool> judged_endpoints_;          // of the system
  std::map<std::uint32_t, Process> processes_;  // by id
  std::optional<Time> begin_, observed_until_;
  Time grown_{};  // when a node was created, or a callback of the contract ran first
  std::size_t nodes_ = 0;
  std::uint64_t losses_ = 0;
  std::optional<Time> lost_at_;  // the latest loss
  bool lossless_ = true;         // lately
  bool ending_ = false;
};

}  // namespace hotpath::watch
