// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "watch/observer.hpp"

namespace hotpath::watch {

using tracing::kNone;

void Observer::note_losses(std::uint64_t losses, Time until) {
  if (losses == losses_) return;
  losses_ = losses;
  lost_at_ = until;
  lossless_ = false;
}

void Observer::observed_until(Time until, const Losses& losses) {
  constexpr auto kPause = std::chrono::milliseconds(100);
  constexpr auto kDoubt = std::chrono::seconds(5);
  note_losses(losses.total(), until);
  lossless_ = !ending_ && (!lost_at_ || until > *lost_at_ + kDoubt);
  if (observed_until_ && until < *observed_until_ + kPause) return;
  observed_until_ = until;
  begin_ = begin_.value_or(until);
  judge_processes(until);
  if (lossless_) judge_never_run(until);
  judge_created_publishers(until);
  judge_running(until);
  for (std::uint32_t entry = 0; lossless_ && entry < states_.size(); ++entry) judge_silence(entry, until);
}

void Observer::judge_running(Time until) {
  for (RunningJob& job : running_.all()) {
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

void Observer::judge_silence(std::uint32_t entry, Time until) {
  CallbackState& state = states_[entry];
  JudgedTerm* const distance = judge_.callback(entry).find(Clause::maximum_distance);
  if (distance == nullptr || !state.last || state.silent) return;
  // Samples wait unread while another callback runs, and those of unwatched publishers are known only when
  // they are taken: only what nothing can explain is silence.
  const Time since = std::max(*state.last, system().callbacks[state.callback].published_for_it);
  if ((until - since).count() <= 2 * distance->term().limit) return;
  state.silent = until;
  state.silent_since = since;
  distance->judge_lasting(since, until);
}

void Observer::forget(const ThreadKey& ended) {
  thread_check_.forget(ended);
  if (ended.second != 0) {
    assembler_.forget_thread(ended.first, ended.second);
    timestamps_.forget(ended);
    return;
  }
  assembler_.forget_process(ended.first);
  const auto process = processes_.find(ended.first);
  if (process != processes_.end()) process->second.ended = observed_until_.value_or(process->second.finish);
}

/// Processes that have ended while others go on. At the end of a run, they end one after another.
void Observer::judge_processes(Time until) {
  constexpr auto kEnding = std::chrono::seconds(2);
  std::erase_if(processes_, [&](const auto& known) {
    const Process& process = known.second;
    if (ending_ || !process.ended || until < *process.ended + kEnding) return false;
    judge_.incidents().add({Role::standstill, process.finish,
                            "the process of " + judge_.callback(process.entry).name + " has ended"});
    return true;
  });
}

/// Callbacks that have never run, although they are due, or samples are published for them. A program may
/// create its nodes long before it runs them.
void Observer::judge_never_run(Time until) {
  constexpr Duration kSearch = std::chrono::seconds(1), kPatience = std::chrono::seconds(10);
  if (!names_.kept() || (searched_ && until < *searched_ + kSearch)) return;
  searched_ = until;
  for (std::uint32_t c = 0; c < system().callbacks.size(); ++c) {
    const tracing::Callback& callback = system().callbacks[c];
    const bool timer = callback.kind == tracing::CallbackKind::timer;
    if (callback.jobs > 0 || (timer ? callback.created + kPatience > until : callback.samples == 0)) continue;
    const std::uint32_t entry = names_.entry_of(c);
    if (entry == kNone) continue;
    Subject& subject = judge_.callback(entry);
    CallbackState& state = states_[entry];
    if (subject.seen || state.never_ran) continue;
    if (!state.waited_for)
      state.waited_for = timer ? std::max(callback.created, *begin_) : callback.published_for_it;
    const JudgedTerm* const distance = subject.find(Clause::maximum_distance);
    if (timer && distance == nullptr) continue;
    const Time latest = timer ? until - 2 * Duration(distance->term().limit) : callback.published_for_it;
    if (latest < *state.waited_for + kPatience) continue;
    state.never_ran = true;
    judge_.incidents().add(
        {Role::standstill, *state.waited_for,
         subject.name + (timer ? " has never run" : " has never run, although it got samples"), nullptr,
         *state.waited_for, until});
  }
}

void Observer::judge_created_publishers(Time until) {
  judged_endpoints_.resize(system().endpoints.size());
  for (std::size_t e = 0; names_.kept() && e < system().endpoints.size(); ++e) {
    const tracing::Endpoint& endpoint = system().endpoints[e];
    if (judged_endpoints_[e] || endpoint.kind != tracing::Endpoint::Kind::publisher ||
        endpoint.topic == kNone)
      continue;
    judged_endpoints_[e] = true;
    const std::uint32_t topic = names_.number_of(endpoint.topic);
    if (topic == kNone) continue;
    judge_.all(Kind::topic)[topic].seen = true;
    judge_publisher(topic, names_.may_publish(endpoint.node, topic),
                    "has a publisher of " + node_name(system(), endpoint.node) + ", which the contract lacks",
                    until);
  }
}

}  // namespace hotpath::watch
