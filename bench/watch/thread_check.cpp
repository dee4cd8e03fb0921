// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_check.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

namespace {

/// The callback in sentences, if it needs to be in the contract: services of parameters and the like
/// belong to every node.
std::string uncovered(const tracing::System& system, const tracing::Callback& callback) {
  const std::string node = callback.node < system.nodes.size() ? system.nodes[callback.node] : "a node";
  if (callback.kind == CallbackKind::timer)
    return program::concat(node, " (timer ", to_ms(callback.period), " ms)");
  if (callback.kind != CallbackKind::subscription) return "";
  const std::string& topic = system.topics[callback.topic].name;
  return imports::is_housekeeping(topic) ? "" : node + " " + topic;
}

constexpr Duration kSecond = std::chrono::seconds(1);

std::string with_unit(Duration duration) { return program::fixed(to_ms(duration), 3) + " ms"; }

}  // namespace

ThreadCheck::ThreadCheck(const Contract& contract) : of_entry_(contract.callbacks.size(), kNone) {
  for (std::uint32_t t = 0; t < contract.threads.size(); ++t) {
    const ThreadContract& thread = contract.threads[t];
    subjects_.emplace_back("thread", thread.name, thread.terms, "no thread ran its callbacks");
    for (const std::uint32_t callback : thread.callbacks) of_entry_[callback] = t;
  }
}

std::string ThreadCheck::name_of(std::uint32_t thread) const {
  const auto known = of_thread_.find(thread);
  return known == of_thread_.end() || known->second == kNone ? "" : subjects_[known->second].name;
}

void ThreadCheck::started(const tracing::System& system, const tracing::Job& job, std::uint32_t entry,
                          Incidents& incidents) {
  if (subjects_.empty()) return;
  const auto& [process, thread] =
      std::pair(system.threads[job.thread].process, system.threads[job.thread].id);
  const auto [owner, is_new] = of_thread_.try_emplace(thread, kNone);
  if (entry != kNone && owner->second == kNone && of_entry_[entry] != kNone) {
    owner->second = of_entry_[entry];
    states_[thread] = {job.start};
    const auto [of_process, first] = of_process_.try_emplace(process, owner->second);
    if (of_process->second != owner->second) of_process->second = kNone;
  }
  if (owner->second == kNone) return;
  Subject& subject = subjects_[owner->second];
  subject.seen = true;
  JudgedTerm* const serves = subject.find(Clause::serves);
  if (serves == nullptr) return;
  const std::string extra = entry != kNone ? "" : uncovered(system, system.callbacks[job.ref.callback]);
  if (extra.empty()) return serves->hold();
  serves->judge(false, "ran " + extra + ", which the contract lacks", job.start, incidents);
}

void ThreadCheck::facts(const std::vector<ThreadFacts>& facts, Time at, Incidents& incidents) {
  previous_ = at_;
  at_ = at;
  for (const ThreadFacts& now : facts) {
    if (const auto executor = of_process_.find(now.process); now.timers && executor != of_process_.end()) {
      of_thread_[now.thread] = executor->second;
      if (executor->second != kNone) states_.try_emplace(now.thread, State{at});
    }
    const auto state = states_.find(now.thread);
    if (state == states_.end()) continue;
    const std::uint32_t owner = of_thread_.at(now.thread);
    if (owner == kNone) continue;  // a timer thread of several executors
    Subject& subject = subjects_[owner];
    judge(subject, now, state->second, incidents);
    note_wait(now, state->second);
    if (JudgedTerm* const wait = subject.find(Clause::wait)) {
      explain(*wait, now.name, state->second, incidents);
      judge_wait(*wait, now.name, state->second, incidents);
    }
    state->second.before = now;
  }
  std::erase_if(states_, [&](const auto& state) {  // threads that have ended
    return state.second.before && std::ranges::find(facts, state.first, &ThreadFacts::thread) == facts.end();
  });
}

/// The policy and the processors of a timer thread are not stated: it only must not change.
void ThreadCheck::judge(Subject& subject, const ThreadFacts& now, const State& state,
                        Incidents& incidents) const {
  const std::string name = "thread " + now.name + " ";
  const ThreadFacts* const before = state.before ? &*state.before : nullptr;
  const Time since = before ? *previous_ : state.first_start;
  if (now.timers && before == nullptr) return;
  if (JudgedTerm* const policy = subject.find(Clause::policy)) {
    const bool changed = before != nullptr && !(now.policy == before->policy);
    const bool holds = now.timers ? !changed : now.policy == policy->term().policy;
    policy->judge(holds,
                  program::concat(name, "has the policy ", to_string(now.policy),
                                  changed ? " instead of " + to_string(before->policy) : std::string(),
                                  now.timers ? "" : ", contract " + policy->limit_text()),
                  since, incidents, before != nullptr && !changed);
  }
  if (JudgedTerm* const processors = subject.find(Clause::processors)) {
    const auto allowed = static_cast<std::uint64_t>(processors->term().limit);
    const bool changed = before != nullptr && now.processors != before->processors;
    const bool holds = now.timers ? !changed : (now.processors & ~allowed) == 0 && now.processors != 0;
    processors->judge(
        holds,
        program::concat(name, "may run on processors ",
                        processors->shown(static_cast<std::int64_t>(now.processors)),
                        now.timers ? ", before on others" : ", contract " + processors->limit_text()),
        since, incidents, before != nullptr && !changed);
  }
}

/// Adds what the thread waited until now. The hypervisor's counter may grow late, or by more than
/// passed: the thread cannot have run in time that was withheld.
void ThreadCheck::note_wait(const ThreadFacts& now, State& state) const {
  std::deque<Waited>& waited = state.waited;
  if (waited.empty()) waited.push_back({state.first_start});
  Duration stolen = waited.back().stolen;
  if (state.before && state.before->processor == now.processor) {  // each one has a counter of its own
    const Duration idle = *at_ - waited.back().at - (now.ran - state.before->ran);
    stolen +=
        std::clamp(now.stolen - state.before->stolen, Duration::zero(), std::max(idle, Duration::zero()));
  }
  waited.push_back({*at_, now.waited, stolen});
  if (waited.size() <= kMostWaited) return;
  waited.pop_front();
  state.exact = true;
}

/// A wait that is too long within a second breaks the term.
void ThreadCheck::judge_wait(JudgedTerm& wait, const std::string& name, State& state,
                             Incidents& incidents) const {
  std::deque<Waited>& waited = state.waited;
  auto from = waited.begin() + (state.exact ? 0 : 1);  // it may have waited before its first job
  if (std::next(from) == waited.end()) return;
  while (from->at < *at_ - kSecond && std::next(from, 2) != waited.end()) ++from;
  Duration in_a_second = waited.back().waited - from->waited;
  if (const Duration covered = *at_ - from->at; covered > kSecond)  // the watcher got too little CPU time
    in_a_second =
        Duration(std::llround(static_cast<double>(in_a_second.count()) * (to_ms(kSecond) / to_ms(covered))));
  wait.observe(in_a_second.count());
  if (in_a_second.count() <= wait.term().limit) return wait.hold();
  auto longest = from;
  for (auto w = from; std::next(w) != waited.end(); ++w)
    if (std::next(w)->waited - w->waited > std::next(longest)->waited - longest->waited) longest = w;
  judge_wait(wait, name, *longest, waited.back(), incidents);
  waited.erase(waited.begin(), std::prev(waited.end()));  // each wait counts once
  state.exact = true;
}

/// A wait that explains an exceeded bound breaks the term as well. Time that the hypervisor withheld
/// also explains a broken assumption: a callback or a publisher is not to blame for it.
void ThreadCheck::explain(JudgedTerm& wait, const std::string& name, const State& state,
                          Incidents& incidents) const {
  if (incidents.kept().empty()) return;
  const Incident& incident = incidents.kept().back();
  const Breach& breach = incident.begin();
  const auto& cause = incident.first(Role::assumption);
  const auto after = std::ranges::find_if(state.waited, [&](const Waited& w) { return w.at >= breach.at; });
  if (breach.excess <= Duration::zero() || after == state.waited.end() || after == state.waited.begin())
    return;
  auto before = after;
  do --before;
  while (before != state.waited.begin() && before->at > breach.since);
  const Duration stolen = after->stolen - before->stolen, waited = after->waited - before->waited;
  const bool assumption = cause && cause->at <= breach.at;
  if ((assumption ? stolen : waited + stolen) >= breach.excess)
    judge_wait(wait, name, *before, *after, incidents);
}

void ThreadCheck::judge_wait(JudgedTerm& wait, const std::string& name, const Waited& from, const Waited& to,
                             Incidents& incidents) {
  const Duration stolen = to.stolen - from.stolen;
  wait.judge(
      false,
      program::concat("thread ", name, " waited ", with_unit(to.waited - from.waited + stolen), " of ",
                      with_unit(to.at - from.at), " for a processor",
                      stolen > Duration::zero() ? " (the hypervisor withheld it " + with_unit(stolen) + ")"
                                                : std::string(),
                      ", limit ", wait.limit_text(), " in a second"),
      from.at, incidents);
}

}  // namespace hotpath::watch
