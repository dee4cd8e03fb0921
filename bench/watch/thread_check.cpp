// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_check.hpp"

#include <algorithm>

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

std::string shown_ms(Duration duration) { return program::fixed(to_ms(duration), 3) + " ms"; }

}  // namespace

ThreadCheck::ThreadCheck(const Contract& contract) : of_entry_(contract.callbacks.size(), kNone) {
  for (std::uint32_t t = 0; t < contract.threads.size(); ++t) {
    const ThreadContract& thread = contract.threads[t];
    subjects_.emplace_back("thread", thread.name, thread.terms, "no thread ran its callbacks");
    for (const std::uint32_t callback : thread.callbacks) of_entry_[callback] = t;
  }
}

std::string ThreadCheck::name_of(std::uint32_t thread) const {
  const bool known = thread < of_thread_.size() && of_thread_[thread] != kNone;
  return known ? subjects_[of_thread_[thread]].name : "";
}

void ThreadCheck::started(const tracing::System& system, const tracing::Job& job, std::uint32_t entry,
                          Incident& incident) {
  if (subjects_.empty()) return;
  if (job.thread >= of_thread_.size()) of_thread_.resize(job.thread + 1, kNone);
  first_starts_.resize(of_thread_.size());
  std::uint32_t& owner = of_thread_[job.thread];
  if (entry != kNone && owner == kNone) {
    owner = of_entry_[entry];
    first_starts_[job.thread] = job.start;
  }
  if (owner == kNone) return;
  Subject& subject = subjects_[owner];
  subject.seen = true;
  JudgedTerm* const serves = subject.find(Clause::serves);
  if (serves == nullptr) return;
  const std::string extra = entry != kNone ? "" : uncovered(system, system.callbacks[job.ref.callback]);
  if (extra.empty()) return serves->hold();
  serves->judge(false, "ran " + extra + ", which the contract lacks", job.start, incident);
}

void ThreadCheck::facts(const std::vector<std::optional<ThreadFacts>>& facts, Time at, Incident& incident) {
  previous_ = at_;
  at_ = at;
  for (std::size_t t = 0; t < facts.size() && t < of_thread_.size(); ++t) {
    if (of_thread_[t] == kNone || !facts[t]) continue;
    const bool known = previous_ && t < before_.size() && before_[t];
    ThreadFacts before = known ? *before_[t] : *facts[t];
    if (!known) before.waited = Duration::zero();
    const Interval interval{known ? *previous_ : first_starts_[t], at, known};
    Subject& subject = subjects_[of_thread_[t]];
    judge(subject, *facts[t], before, interval, incident);
    judge_wait(subject, *facts[t], before, interval, incident);
  }
  before_ = facts;
}

void ThreadCheck::judge(Subject& subject, const ThreadFacts& now, const ThreadFacts& before,
                        const Interval& interval, Incident& incident) {
  const std::string name = "thread " + now.name + " ";
  if (JudgedTerm* const policy = subject.find(Clause::policy)) {
    const bool changed = !(now.policy == before.policy);
    policy->judge(now.policy == policy->term().policy,
                  program::concat(name, "has the policy ", to_string(now.policy),
                                  changed ? " instead of " + to_string(before.policy) : std::string(),
                                  ", contract ", policy->limit_text()),
                  interval.begin, incident);
  }
  if (JudgedTerm* const processors = subject.find(Clause::processors)) {
    const auto allowed = static_cast<std::uint64_t>(processors->term().limit);
    processors->judge((now.processors & ~allowed) == 0 && now.processors != 0,
                      program::concat(name, "may run on processors ",
                                      processors->shown(static_cast<std::int64_t>(now.processors)),
                                      ", contract ", processors->limit_text()),
                      interval.begin, incident);
  }
}

/// A wait that is long enough to explain an exceeded bound breaks the term as well.
void ThreadCheck::judge_wait(Subject& subject, const ThreadFacts& now, const ThreadFacts& before,
                             const Interval& interval, Incident& incident) {
  JudgedTerm* const wait = subject.find(Clause::wait);
  if (wait == nullptr) return;
  const bool stayed = now.processor == before.processor;  // each processor has a counter of its own
  const Duration stolen = stayed ? std::max(Duration::zero(), now.stolen - before.stolen) : Duration::zero();
  const Duration waited = std::max(Duration::zero(), now.waited - before.waited) + stolen;
  const Duration passed = std::max(interval.end - interval.begin, Duration(1));
  const auto &bound = incident.first(Role::bound), &cause = incident.first(Role::assumption);
  const bool explains = bound && (!cause || cause->at > bound->at) && bound->at > interval.begin &&
                        bound->at <= interval.end && waited >= bound->excess;
  if (!interval.exact && !explains) return;  // it may have waited before its first job
  const Duration in_a_second = from_ms(1000 * to_ms(waited) / to_ms(passed));
  wait->observe(in_a_second.count());
  wait->judge(
      in_a_second.count() <= wait->term().limit && !explains,
      program::concat("thread ", now.name, " waited ", shown_ms(waited), " of ", shown_ms(passed),
                      " for a processor",
                      stolen > Duration::zero() ? " (the hypervisor withheld it " + shown_ms(stolen) + ")"
                                                : std::string(),
                      ", limit ", wait->limit_text(), " in a second"),
      interval.begin, incident);
}

}  // namespace hotpath::watch
