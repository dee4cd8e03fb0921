// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_check.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"

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

/// The callback in sentences, if it needs to be in the contract.
std::string uncovered(const tracing::System& system, const tracing::Callback& callback) {
  const std::string node = callback.node < system.nodes.size() ? system.nodes[callback.node] : "a node";
  if (callback.kind == CallbackKind::timer)
    return program::concat(node, " (timer ", to_ms(callback.period), " ms)");
  const bool service = callback.kind == CallbackKind::service;
  if ((!service && callback.kind != CallbackKind::subscription) || callback.topic == kNone) return "";
  const std::string& topic = system.topics[callback.topic].name;
  if (service) return is_of_every_node(topic) ? "" : program::concat(node, " ", topic, " (service)");
  return imports::is_housekeeping(topic) ? "" : node + " " + topic;
}

constexpr Duration kSecond = std::chrono::seconds(1);
/// What an executor runs beside a job, at least.
constexpr Duration kExecutor = std::chrono::microseconds(100);

std::string with_unit(Duration duration) { return program::fixed(to_ms(duration), 3) + " ms"; }

}  // namespace

ThreadCheck::ThreadCheck(const Contract& contract) : of_entry_(contract.callbacks.size(), kNone) {
  for (std::uint32_t t = 0; t < contract.threads.size(); ++t) {
    const ThreadContract& thread = contract.threads[t];
    subjects_.emplace_back("thread", thread.name, thread.terms, "no thread ran its callbacks");
    for (const std::uint32_t callback : thread.callbacks) {
      of_entry_[callback] = t;
      if (contract.callbacks[callback].topic.empty()) of_timer_[contract.callbacks[callback].name()] = t;
    }
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
  if (state.work.open++ == 0) state.work.since = job.start;
  if (state.owner == kNone) return;
  Subject& subject = subjects_[state.owner];
  subject.seen = true;
  JudgedTerm* const serves = subject.find(Clause::serves);
  if (serves == nullptr) return;
  const std::string extra = entry != kNone ? "" : uncovered(system, system.callbacks[job.ref.callback]);
  if (extra.empty()) return serves->hold();
  serves->judge(false, "ran " + extra + ", which the contract lacks", job.start, incidents);
}

void ThreadCheck::ended(const tracing::System& system, const tracing::Job& job) {
  const auto state = states_.find(key_of(system.threads[job.thread]));
  if (state == states_.end() || state->second.work.open == 0) return;
  Work& work = state->second.work;
  if (--work.open > 0 || !job.ended) return;
  work.ended.emplace_back(work.since, job.finish);
  if (work.ended.size() > kMostJobs) work.ended.pop_front();  // there are no readings of this thread
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
      note_wait(now, state);
    }
    state.before = now;
    JudgedTerm* const wait = subject == nullptr ? nullptr : subject->find(Clause::wait);
    if (wait == nullptr) continue;
    explain(*wait, state, incidents);
    judge_wait(*wait, state, incidents);
  }
  forget(facts);
}

/// Threads and processes that have ended, unless all have.
void ThreadCheck::forget(const std::vector<ThreadFacts>& facts) {
  if (facts.empty()) return;
  std::set<ThreadKey> living;
  for (const ThreadFacts& now : facts) living.insert(now.key());
  std::erase_if(states_, [&](const auto& state) {
    const bool is_old = state.second.before || state.second.first_start + kForgotten < *at_;
    return is_old && !living.contains(state.first);
  });
  std::erase_if(of_process_, [&](const auto& process) {
    const auto thread = states_.lower_bound({process.first, 0});
    return thread == states_.end() || thread->first.first != process.first;
  });
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
    const auto allowed = static_cast<std::uint64_t>(processors->term().limit);
    compare(*processors, before != nullptr && now.processors != before->processors, now.processors == allowed,
            " may run on processors " + shown_processors(now.processors) +
                (now.timers ? ", before on others" : ""));
  }
}

/// Adds what the thread waited until now. The hypervisor's counter may grow late, or by more than
/// passed: the thread cannot have run in time that was withheld.
void ThreadCheck::note_wait(const ThreadFacts& now, State& state) {
  Readings& readings = state.readings;
  Reading next{*at_, now.waited};
  if (!readings.empty()) {
    const Reading& last = readings.back();
    const Duration ran = now.ran - state.before->ran, idle = *at_ - last.at - ran;
    next.stolen = last.stolen;
    next.ran_aside = last.ran_aside + ran;
    next.jobs = last.jobs;
    const bool stayed = state.before->processor == now.processor;  // each has a counter of its own
    if (stayed && now.stolen > state.before->stolen) {
      withheld_ = at_;
      next.stolen += std::clamp(idle, Duration::zero(), now.stolen - state.before->stolen);
    }
  }
  note_work(state.work, readings.empty() ? *at_ : readings.back().at, next);
  readings.push_back(next);
  if (readings.size() > kMostReadings) readings.pop_front();
}

/// Takes the lengths of jobs from what the thread ran since an instant, until the reading.
void ThreadCheck::note_work(Work& work, Time since, Reading& now) {
  const auto take = [&](Time start, Time finish) {
    now.ran_aside -= std::max(std::min(finish, now.at) - std::max(start, since), Duration::zero());
    now.idle = now.idle && (start >= now.at || finish <= now.at);
  };
  for (const auto& [start, finish] : work.ended) {
    take(start, finish);
    now.jobs += finish <= now.at ? 1 : 0;
  }
  std::erase_if(work.ended, [&](const auto& job) { return job.second <= now.at; });
  if (work.open > 0) take(work.since, Time::max());
}

/// What the jobs of the thread have lasted at most while it did not run, between two readings, extended
/// to readings at which it was idle: beside its jobs, it runs the executor, for each job as long as it
/// lately did. std::nullopt: a later reading may tell.
std::optional<Duration> ThreadCheck::most_waited_in_jobs(const Readings& readings,
                                                         Readings::const_iterator from,
                                                         Readings::const_iterator to) {
  while (from != readings.begin() && !from->idle) --from;
  const Time end = to->at;
  to = std::find_if(to, readings.end(), [](const Reading& r) { return r.idle; });
  if (to == readings.end()) {
    if (readings.back().at < end + kSecond) return std::nullopt;
    --to;
  }
  std::vector<Duration> executor = {kExecutor};
  for (auto r = readings.begin(); std::next(r) != readings.end(); ++r) {
    const auto next = std::next(r);
    if (r->idle && next->idle && next->jobs > r->jobs)
      executor.push_back((next->ran_aside - r->ran_aside) / static_cast<std::int64_t>(next->jobs - r->jobs));
  }
  const auto median = executor.begin() + static_cast<std::ptrdiff_t>(executor.size() / 2);
  std::ranges::nth_element(executor, median);
  return static_cast<std::int64_t>(to->jobs - from->jobs) * std::max(*median, kExecutor) -
         (to->ran_aside - from->ran_aside);
}

std::string ThreadCheck::sentence(const JudgedTerm& wait, const State& state, const Reading& from,
                                  const Reading& to) {
  const Duration stolen = to.stolen - from.stolen, waited = to.waited - from.waited + stolen;
  return program::concat(
      "thread ", state.before->name, " waited ", with_unit(waited), " of ",
      with_unit(std::max(to.at - from.at, waited)), " for a processor",
      stolen > Duration::zero() ? " (the hypervisor withheld it " + with_unit(stolen) + ")" : std::string(),
      ", limit ", wait.limit_text(), " in a second");
}

/// A wait that is too long within a second breaks the term.
void ThreadCheck::judge_wait(JudgedTerm& wait, State& state, Incidents& incidents) const {
  const Readings& readings = state.readings;
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
  wait.judge(false, sentence(wait, state, *longest, readings.back()), begin, incidents);
  state.judged = *at_;  // each wait counts once
}

/// Whether a wait of the thread can delay what broke the term: for budgets it is the thread that ran the
/// job, for the distance between two jobs of a timer one of its executor.
bool ThreadCheck::may_explain(const Breach& breach, const State& state) const {
  if (breach.thread) return *breach.thread == state.before->key();
  const auto timer = of_timer_.find(breach.term->subject());
  return breach.term->clause() != Clause::maximum_distance || timer == of_timer_.end() ||
         timer->second == state.owner;
}

/// A wait that explains what began an incident breaks the term as well, and is its cause. It explains an
/// exceeded bound at once, but broken assumptions only if they held as soon as the wait was over: a timer
/// of another period breaks them again.
void ThreadCheck::explain(JudgedTerm& wait, State& state, Incidents& incidents) const {
  if (incidents.kept().empty()) return;
  const Breach& begin = incidents.kept().back().begin();
  const bool assumption = role_of(begin.term->clause()) == Role::assumption;
  const Breach* const breach = assumption ? begin.term->ended_breaches() : &begin;
  if (begin.excess <= Duration::zero() || breach == nullptr || breach->at != begin.at ||
      breach->excess <= Duration::zero() || !may_explain(begin, state))
    return;
  const auto first = state.readings.cbegin();
  const auto after =
      std::find_if(first, state.readings.cend(), [&](const Reading& r) { return r.at >= breach->until; });
  if (after == state.readings.cend() || after == first) return;
  auto before = after;
  do --before;
  while (before != first && before->at > breach->since);
  if (before->at > begin.at ||
      after->waited - before->waited + after->stolen - before->stolen < breach->excess)
    return;
  if (begin.thread &&
      most_waited_in_jobs(state.readings, before, after).value_or(Duration::zero()) < breach->excess)
    return;
  const std::string said = sentence(wait, state, *before, *after);
  if (before->at < state.judged) return wait.restate(said, before->at, incidents);
  state.judged = after->at;
  wait.judge(false, said, before->at, incidents);
}

}  // namespace hotpath::watch
