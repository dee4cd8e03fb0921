// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "import/recorded_graph.hpp"
#include "program/text.hpp"
#include "watch/judge.hpp"
#include "watch/stated_names.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// Compares the threads that run callbacks with those of a contract. A thread belongs to the
/// executor whose callbacks it runs, a timer thread to the only executor of its process.
class ThreadCheck {
 public:
  /// Both must outlive it.
  ThreadCheck(const StatedNames& names, Judge& judge)
      : system_(names.system), judge_(judge), of_entry_(names.contract.callbacks.size()) {
    for (std::size_t t = 0; t < names.contract.threads.size(); ++t)
      for (const std::uint32_t callback : names.contract.threads[t].callbacks)
        of_entry_[callback] = &judge.all(Kind::thread)[t];
  }

  /// A job starts. `entry`: its callback in the contract; tracing::kNone: none.
  void started(const tracing::Job& job, std::uint32_t entry) {
    if (judge_.all(Kind::thread).empty()) return;
    const ThreadKey thread = key_of(system_.threads[job.thread]);
    State& state = states_.try_emplace(thread, State{job.start}).first->second;
    if (entry != tracing::kNone && state.owner == nullptr && of_entry_[entry] != nullptr) {
      state = {job.start, of_entry_[entry]};
      const auto [of_process, first] = of_process_.try_emplace(thread.first, state.owner);
      if (of_process->second != state.owner) of_process->second = nullptr;
    }
    if (state.owner == nullptr) return;
    state.owner->seen = true;
    JudgedTerm* const serves = state.owner->find(Clause::serves);
    if (serves == nullptr) return;
    const tracing::Callback& callback = system_.callbacks[job.ref.callback];
    if (entry != tracing::kNone || !needs_entry(callback)) return serves->hold();
    serves->judge(false, "ran " + callback_name(system_, callback) + ", which the contract lacks", job.start);
  }
  /// Facts of the system's threads. They cover the time since the previous ones.
  void facts(const std::vector<ThreadFacts>& facts, Time at) {
    previous_ = std::exchange(at_, at);
    for (const ThreadFacts& now : facts) {
      if (const auto executor = of_process_.find(now.process); now.timers && executor != of_process_.end())
        states_.try_emplace(now.key(), State{at}).first->second.owner = executor->second;
      const auto known = states_.find(now.key());
      if (known == states_.end()) continue;
      State& state = known->second;
      if (state.before && state.before->started != now.started)
        state = {at};  // another thread of the same id
      if (state.owner != nullptr) {
        judge(now, state);
        judge_progress(now, state);
        note_wait(now, state);
      }
      state.before = now;
      if (state.owner != nullptr) judge_wait(state);
    }
  }
  /// A thread that has ended; id 0: a process with all of its threads.
  void forget(const ThreadKey& ended) {
    if (ended.second != 0) {
      states_.erase(ended);
      return;
    }
    of_process_.erase(ended.first);
    std::erase_if(states_, [&](const auto& state) { return state.first.first == ended.first; });
  }

  [[nodiscard]] std::optional<Time> at() const { return at_; }
  /// The name of the thread's executor; empty: unknown.
  [[nodiscard]] std::string name_of(const ThreadKey& thread) const {
    const auto known = states_.find(thread);
    return known == states_.end() || known->second.owner == nullptr ? "" : known->second.owner->name;
  }
  /// Whether the thread has run nothing since the previous facts, although it could.
  [[nodiscard]] bool stands(const ThreadKey& thread) const {
    const auto known = states_.find(thread);
    return known != states_.end() && known->second.stands.has_value();
  }
  /// How long threads waited, from the reading before the first instant to the one after the second, unless
  /// that broke a term. A long one that takes three quarters of that time is more severe than a term.
  [[nodiscard]] std::vector<Fact> waits(Time since, Time until) const {
    std::vector<Fact> all;
    for (const auto& [key, state] : states_) {
      if (state.readings.empty() || state.owner == nullptr || state.judged >= since) continue;
      auto from = std::ranges::upper_bound(state.readings, since, {}, &Reading::at);
      const auto to = std::ranges::lower_bound(from, state.readings.end(), until, {}, &Reading::at);
      if (from != state.readings.begin()) --from;
      const Reading& last = to == state.readings.end() ? state.readings.back() : *to;
      const Duration waited = last.waited + last.stolen - from->waited - from->stolen;
      const bool stands = waited >= std::max(kStandstill, (last.at - from->at) * 3 / 4);
      if (waited >= kShortestWait)
        all.push_back({stands ? Role::standstill : Role::circumstance, from->at,
                       state.owner->name + " " + sentence(state, *from, last)});
    }
    return all;
  }

 private:
  static constexpr Duration kSecond = std::chrono::seconds(1);
  /// A thread that waits as long in a second does not run.
  static constexpr Duration kStandstill = std::chrono::milliseconds(100);
  /// For which a ready thread is seen to run nothing: Linux counts what it runs at least once in a second.
  static constexpr Duration kNoProgress = std::chrono::milliseconds(1500);
  /// Shorter waits are no circumstance.
  static constexpr Duration kShortestWait = std::chrono::microseconds(100);
  /// At the shortest distance of facts, five seconds.
  static constexpr std::size_t kMostReadings = 256;
  /// Every node has these services: those of its parameters, and of the types of its interfaces.
  static constexpr std::string_view kOfEveryNode[] = {
      "get_parameters",      "get_parameter_types", "set_parameters",      "set_parameters_atomically",
      "describe_parameters", "list_parameters",     "get_type_description"};

  /// What a thread waited since its first reading.
  struct Reading {
    Time at{};
    Duration waited{}, stolen{};
    std::uint64_t throttled = 0;
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
  /// Whether the callback needs to be in the contract.
  [[nodiscard]] bool needs_entry(const tracing::Callback& callback) const {
    using tracing::CallbackKind;
    if (callback.kind == CallbackKind::timer) return true;
    const bool service = callback.kind == CallbackKind::service;
    if ((!service && callback.kind != CallbackKind::subscription) || callback.topic == tracing::kNone)
      return false;
    const std::string& topic = system_.topics[callback.topic].name;
    if (!service) return !imports::is_housekeeping(topic);
    return std::ranges::count(kOfEveryNode, topic.substr(topic.rfind('/') + 1)) == 0;
  }
  /// The policy and the processors of a timer thread are not stated: it only must not change.
  void judge(const ThreadFacts& now, const State& state) const {
    if (now.timers && !state.before) return;
    const ThreadFacts before = state.before.value_or(now);
    const Time since = state.before ? *previous_ : state.first_start;
    const auto compare = [&](JudgedTerm& term, bool changed, bool as_stated, const std::string& observed) {
      term.judge(now.timers ? !changed : as_stated,
                 "thread " + now.name + observed + (now.timers ? "" : ", contract " + term.limit_text()),
                 since, state.before && !changed);
    };
    if (JudgedTerm* const policy = state.owner->find(Clause::policy)) {
      const bool changed = now.policy != before.policy;
      const ThreadPolicy stated = policy->term().policy;
      compare(*policy, changed, now.policy == stated || (now.inherited && stated == ThreadPolicy{}),
              " has the policy " + to_string(now.policy) +
                  (changed ? " instead of " + to_string(before.policy) : ""));
    }
    if (JudgedTerm* const processors = state.owner->find(Clause::processors))
      compare(*processors, now.processors != before.processors,
              now.processors == processors->term().processors,
              " may run on processors " + program::joined(now.processors, ",") +
                  (now.timers ? ", before on others" : ""));
  }
  void judge_progress(const ThreadFacts& now, State& state) {
    constexpr char kReady = 'R', kStopped = 'T';
    const bool could_run = now.state == kReady || now.state == kStopped;
    if (!could_run || !state.before || now.ran != state.before->ran) {
      state.stands.reset();
      state.stood = false;
      return;
    }
    state.stands = state.stands.value_or(*previous_);
    if (state.stood || (now.state == kReady && *at_ - *state.stands < kNoProgress)) return;
    state.stood = true;
    judge_.incidents().add(
        {Role::standstill, *state.stands,
         state.owner->name + " thread " + now.name + " has run nothing for " +
             shown_ms(*at_ - *state.stands) + ", " +
             (now.state == kStopped ? "because it is stopped" : "although it is ready") +
             throttling(!state.readings.empty() && now.throttled > state.readings.front().throttled,
                        now.quota),
         nullptr, *state.stands, *at_});
  }
  /// Adds what the thread waited until now. The hypervisor's counter may grow late, or by more than
  /// passed: the thread cannot have run in time that was withheld.
  void note_wait(const ThreadFacts& now, State& state) const {
    std::deque<Reading>& readings = state.readings;
    Reading next{*at_, now.waited, {}, now.throttled};
    if (!readings.empty()) {
      const Duration idle = *at_ - readings.back().at - (now.ran - state.before->ran);
      const bool stayed = state.before->processor == now.processor;  // each has a counter of its own
      next.stolen = readings.back().stolen;
      if (stayed && now.stolen > state.before->stolen)
        next.stolen += std::clamp(idle, Duration::zero(), now.stolen - state.before->stolen);
    }
    readings.push_back(next);
    if (readings.size() > kMostReadings) readings.pop_front();
  }
  /// A wait that is too long within a second breaks the term.
  void judge_wait(State& state) const {
    JudgedTerm* const wait = state.owner->find(Clause::wait);
    const std::deque<Reading>& readings = state.readings;
    auto from = readings.begin();
    while (std::next(from) != readings.end() && from->at < state.judged) ++from;
    if (wait == nullptr || std::next(from) == readings.end()) return;
    while (from->at < *at_ - kSecond && std::next(from, 2) != readings.end()) ++from;
    Duration in_a_second = readings.back().waited - from->waited;
    if (const Duration covered = *at_ - from->at; covered > kSecond)  // the watcher got too little CPU time
      in_a_second = Duration(
          std::llround(static_cast<double>(in_a_second.count()) * (to_ms(kSecond) / to_ms(covered))));
    wait->observe(in_a_second.count());
    if (in_a_second.count() <= wait->term().limit) return wait->hold();
    auto longest = from;
    for (auto r = from; std::next(r) != readings.end(); ++r)
      if (std::next(r)->waited - r->waited > std::next(longest)->waited - longest->waited) longest = r;
    // Linux counts a wait when it ends: it may have begun before the facts that precede its end.
    const auto end = std::next(longest);
    const Time begin = std::min(longest->at, end->at - (end->waited - longest->waited));
    const bool stands = readings.back().waited - longest->waited >= kStandstill;
    wait->fail({stands ? Role::standstill : Role::assumption, begin,
                wait->subject() + " " + sentence(state, *longest, readings.back()) + ", limit " +
                    wait->limit_text() + " in a second",
                wait, begin, *at_});
    state.judged = *at_;  // each wait counts once
  }
  [[nodiscard]] static std::string sentence(const State& state, const Reading& from, const Reading& to) {
    const Duration stolen = to.stolen - from.stolen, waited = to.waited - from.waited + stolen;
    const bool withheld = stolen > Duration::zero();
    return "thread " + state.before->name + " waited " + shown_ms(waited) + " of " +
           shown_ms(std::max(to.at - from.at, waited)) + " for a processor" +
           (withheld ? " (the hypervisor withheld it " + shown_ms(stolen) + ")" : "") +
           throttling(to.throttled > from.throttled, state.stands ? state.before->quota : "");
  }
  /// Linux counts throttlings when they end: until then, only the quota can tell of one.
  [[nodiscard]] static std::string throttling(bool throttled, const std::string& quota) {
    if (throttled) return " (its control group was throttled)";
    return quota.empty() ? "" : " (its control group may run " + quota + ")";
  }

  const tracing::System& system_;
  Judge& judge_;
  std::vector<Subject*> of_entry_;                // by callback of the contract: its threads
  std::map<std::uint32_t, Subject*> of_process_;  // nullptr: of several executors
  std::map<ThreadKey, State> states_;
  std::optional<Time> previous_, at_;
};

}  // namespace hotpath::watch
