// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_check.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

namespace {

/// Every node has these services: those of its parameters, and of the types of its interfaces.
bool is_of_every_node(const std::string& service) {
  static const std::set<std::string> kNames = {
      "get_parameters",      "get_parameter_types", "set_parameters",      "set_parameters_atomically",
      "describe_parameters", "list_parameters",     "get_type_description"};
  return kNames.contains(service.substr(service.rfind('/') + 1));
}

/// Whether the callback needs to be in the contract.
bool needs_entry(const tracing::System& system, const tracing::Callback& callback) {
  if (callback.kind == CallbackKind::timer) return true;
  const bool service = callback.kind == CallbackKind::service;
  if ((!service && callback.kind != CallbackKind::subscription) || callback.topic == kNone) return false;
  const std::string& topic = system.topics[callback.topic].name;
  return service ? !is_of_every_node(topic) : !imports::is_housekeeping(topic);
}

constexpr Duration kSecond = std::chrono::seconds(1);
/// A thread that waits as long in a second does not run.
constexpr Duration kStandstill = std::chrono::milliseconds(100);
/// For which a thread that could run is seen to run nothing: Linux counts what it runs at least once in a
/// second.
constexpr Duration kNoProgress = std::chrono::milliseconds(1500);
/// Shorter waits are no circumstance.
constexpr Duration kShortestWait = std::chrono::microseconds(100);

std::string with_unit(Duration duration) { return program::fixed(to_ms(duration), 3) + " ms"; }

}  // namespace

ThreadCheck::ThreadCheck(const Contract& contract) : of_entry_(contract.callbacks.size(), kNone) {
  for (std::uint32_t t = 0; t < contract.threads.size(); ++t) {
    const ThreadContract& thread = contract.threads[t];
    subjects_.emplace_back("thread", thread.name, thread.terms, "no thread ran its callbacks");
    for (const std::uint32_t callback : thread.callbacks) of_entry_[callback] = t;
  }
}

std::string ThreadCheck::name_of(const ThreadKey& thread) const {
  const auto known = states_.find(thread);
  return known == states_.end() || known->second.owner == kNone ? "" : subjects_[known->second.owner].name;
}

void ThreadCheck::started(const tracing::System& system, const tracing::Job& job, std::uint32_t entry,
                          Incidents& incidents) {
  if (subjects_.empty()) return;
  const ThreadKey thread = key_of(system.threads[job.thread]);
  State& state = states_.try_emplace(thread, State{job.start}).first->second;
  if (entry != kNone && state.owner == kNone && of_entry_[entry] != kNone) {
    state = {job.start, of_entry_[entry]};
    const auto [of_process, first] = of_process_.try_emplace(thread.first, state.owner);
    if (of_process->second != state.owner) of_process->second = kNone;
  }
  if (state.owner == kNone) return;
  Subject& subject = subjects_[state.owner];
  subject.seen = true;
  JudgedTerm* const serves = subject.find(Clause::serves);
  if (serves == nullptr) return;
  const tracing::Callback& callback = system.callbacks[job.ref.callback];
  if (entry != kNone || !needs_entry(system, callback)) return serves->hold();
  serves->judge(false, "ran " + callback_name(system, callback) + ", which the contract lacks", job.start,
                incidents);
}

void ThreadCheck::facts(const std::vector<ThreadFacts>& facts, Time at, Incidents& incidents) {
  previous_ = at_;
  at_ = at;
  for (const ThreadFacts& now : facts) {
    if (const auto executor = of_process_.find(now.process); now.timers && executor != of_process_.end())
      states_.try_emplace(now.key(), State{at}).first->second.owner = executor->second;
    const auto known = states_.find(now.key());
    if (known == states_.end()) continue;
    State& state = known->second;
    if (state.before && state.before->started != now.started) state = {at};  // another thread of the same id
    Subject* const subject = state.owner == kNone ? nullptr : &subjects_[state.owner];
    if (subject != nullptr) {
      judge(*subject, now, state, incidents);
      judge_progress(*subject, now, state, incidents);
      note_wait(now, state);
    }
    state.before = now;
    JudgedTerm* const wait = subject == nullptr ? nullptr : subject->find(Clause::wait);
    if (wait != nullptr) judge_wait(*wait, state, incidents);
  }
}

void ThreadCheck::forget(const ThreadKey& ended) {
  if (ended.second != 0) {
    states_.erase(ended);
    return;
  }
  of_process_.erase(ended.first);
  std::erase_if(states_, [&](const auto& state) { return state.first.first == ended.first; });
}

/// The policy and the processors of a timer thread are not stated: it only must not change.
void ThreadCheck::judge(Subject& subject, const ThreadFacts& now, const State& state,
                        Incidents& incidents) const {
  const ThreadFacts* const before = state.before ? &*state.before : nullptr;
  const Time since = before ? *previous_ : state.first_start;
  if (now.timers && before == nullptr) return;
  const auto compare = [&](JudgedTerm& term, bool changed, bool as_stated, const std::string& observed) {
    term.judge(now.timers ? !changed : as_stated,
               "thread " + now.name + observed + (now.timers ? "" : ", contract " + term.limit_text()), since,
               incidents, before != nullptr && !changed);
  };
  if (JudgedTerm* const policy = subject.find(Clause::policy)) {
    const bool changed = before != nullptr && now.policy != before->policy;
    compare(*policy, changed, now.policy == policy->term().policy,
            " has the policy " + to_string(now.policy) +
                (changed ? " instead of " + to_string(before->policy) : std::string()));
  }
  if (JudgedTerm* const processors = subject.find(Clause::processors)) {
    compare(*processors, before != nullptr && now.processors != before->processors,
            now.processors == processors->term().processors,
            " may run on processors " + program::joined(now.processors, ",") +
                (now.timers ? ", before on others" : ""));
  }
}

void ThreadCheck::judge_progress(const Subject& subject, const ThreadFacts& now, State& state,
                                 Incidents& incidents) const {
  constexpr char kReady = 'R', kStopped = 'T';
  const bool could_run = now.state == kReady || now.state == kStopped;
  if (!could_run || !state.before || now.ran != state.before->ran) {
    state.stands.reset();
    state.stood = false;
    return;
  }
  state.stands = state.stands.value_or(*previous_);
  if (state.stood || *at_ - *state.stands < kNoProgress) return;
  state.stood = true;
  incidents.add({Role::standstill, *state.stands,
                 program::concat(subject.name, " thread ", now.name, " has run nothing for ",
                                 with_unit(*at_ - *state.stands), ", ",
                                 now.state == kStopped ? "because it is stopped" : "although it is ready"),
                 nullptr, *state.stands, *at_});
}

/// Adds what the thread waited until now. The hypervisor's counter may grow late, or by more than
/// passed: the thread cannot have run in time that was withheld.
void ThreadCheck::note_wait(const ThreadFacts& now, State& state) const {
  std::deque<Reading>& readings = state.readings;
  Reading next{*at_, now.waited};
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

std::string ThreadCheck::sentence(const State& state, const Reading& from, const Reading& to) {
  const Duration stolen = to.stolen - from.stolen, waited = to.waited - from.waited + stolen;
  return program::concat(
      "thread ", state.before->name, " waited ", with_unit(waited), " of ",
      with_unit(std::max(to.at - from.at, waited)), " for a processor",
      stolen > Duration::zero() ? " (the hypervisor withheld it " + with_unit(stolen) + ")" : std::string());
}

std::vector<Fact> ThreadCheck::waits(Time since, Time until) const {
  std::vector<Fact> all;
  for (const auto& [key, state] : states_) {
    if (state.readings.empty() || state.owner == kNone || state.judged >= since) continue;
    auto from = std::ranges::upper_bound(state.readings, since, {}, &Reading::at);
    const auto to = std::ranges::lower_bound(from, state.readings.end(), until, {}, &Reading::at);
    if (from != state.readings.begin()) --from;
    const Reading& last = to == state.readings.end() ? state.readings.back() : *to;
    if (last.waited + last.stolen - from->waited - from->stolen >= kShortestWait)
      all.push_back(
          {Role::circumstance, from->at, subjects_[state.owner].name + " " + sentence(state, *from, last)});
  }
  return all;
}

/// A wait that is too long within a second breaks the term.
void ThreadCheck::judge_wait(JudgedTerm& wait, State& state, Incidents& incidents) const {
  const std::deque<Reading>& readings = state.readings;
  auto from = readings.begin();
  while (std::next(from) != readings.end() && from->at < state.judged) ++from;
  if (std::next(from) == readings.end()) return;
  while (from->at < *at_ - kSecond && std::next(from, 2) != readings.end()) ++from;
  Duration in_a_second = readings.back().waited - from->waited;
  if (const Duration covered = *at_ - from->at; covered > kSecond)  // the watcher got too little CPU time
    in_a_second =
        Duration(std::llround(static_cast<double>(in_a_second.count()) * (to_ms(kSecond) / to_ms(covered))));
  wait.observe(in_a_second.count());
  if (in_a_second.count() <= wait.term().limit) return wait.hold();
  auto longest = from;
  for (auto r = from; std::next(r) != readings.end(); ++r)
    if (std::next(r)->waited - r->waited > std::next(longest)->waited - longest->waited) longest = r;
  // Linux counts a wait when it ends: it may have begun before the facts that precede its end.
  const auto end = std::next(longest);
  const Time begin = std::min(longest->at, end->at - (end->waited - longest->waited));
  const Role role =
      readings.back().waited - longest->waited < kStandstill ? Role::assumption : Role::standstill;
  wait.fail({role, begin,
             wait.subject() + " " + sentence(state, *longest, readings.back()) + ", limit " +
                 wait.limit_text() + " in a second",
             &wait, begin, *at_},
            incidents);
  state.judged = *at_;  // each wait counts once
}

}  // namespace hotpath::watch
