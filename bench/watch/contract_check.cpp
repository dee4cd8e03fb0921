// SPDX-License-Identifier: Apache-2.0
#include "watch/contract_check.hpp"

#include <algorithm>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

ContractCheck::ContractCheck(Contract contract, const WallClock& clock)
    : contract_(std::move(contract)),
      clock_(clock),
      states_(contract_.callbacks.size()),
      names_(contract_),
      chain_check_(contract_, names_),
      thread_check_(contract_),
      publisher_check_(contract_, names_) {
  for (const CallbackContract& callback : contract_.callbacks)
    subjects_.emplace_back("callback", callback.name(), callback.terms, "no such callback has run");
  for (const ChainContract& chain : contract_.chains)
    subjects_.emplace_back("chain", chain.name, chain.terms, "no data of its sources reached its end");
}

std::uint32_t ContractCheck::entry_of(const tracing::System& system, std::uint32_t callback) {
  if (callback >= entries_.size()) entries_.resize(callback + 1);
  if (!names_.resolve(system)) return kNone;
  if (std::exchange(changes_, names_.changes()) != names_.changes())
    std::ranges::fill(entries_, std::nullopt);
  if (!entries_[callback]) entries_[callback] = find_entry(system, callback);
  if (*entries_[callback] != kNone) names_.keep();
  return *entries_[callback];
}

std::uint32_t ContractCheck::find_entry(const tracing::System& system, std::uint32_t callback) const {
  const tracing::Callback& of = system.callbacks[callback];
  const bool timer = of.kind == CallbackKind::timer, service = of.kind == CallbackKind::service,
             subscription = of.kind == CallbackKind::subscription;
  if (of.node >= system.nodes.size() || (!timer && !service && !subscription)) return kNone;
  if (!timer && of.topic >= system.topics.size()) return kNone;
  const std::string node = names_.node(system, of.node);
  const std::string topic = timer ? "" : names_.topic(system, of.topic);
  std::uint32_t number = 0;
  for (std::uint32_t c = 0; c <= callback; ++c)
    number += system.callbacks[c].kind == CallbackKind::timer && system.callbacks[c].node == of.node ? 1 : 0;
  const auto entry_for = [&](bool a_service) {
    return std::ranges::find_if(contract_.callbacks, [&](const CallbackContract& stated) {
      return stated.node == node && stated.topic == topic && stated.service == a_service &&
             (!timer || stated.timer == number);
    });
  };
  const auto is_service = [&](const tracing::Callback& c) {
    return c.kind == CallbackKind::service && c.node == of.node && c.topic < system.topics.size() &&
           system.topics[c.topic].name == system.topics[of.topic].name;
  };
  auto entry = entry_for(service);
  // Without ROS 2, subscriptions stand for the services of a graph.
  if (entry == contract_.callbacks.end() && subscription &&
      std::ranges::none_of(system.callbacks, is_service))
    entry = entry_for(true);
  if (entry == contract_.callbacks.end() && timer) return replaced_timer(node, number, of);
  return entry == contract_.callbacks.end() ? kNone
                                            : static_cast<std::uint32_t>(entry - contract_.callbacks.begin());
}

std::uint32_t ContractCheck::replaced_timer(const std::string& node, std::uint32_t number,
                                            const tracing::Callback& by) const {
  std::uint32_t replaced = kNone;
  for (std::uint32_t c = 0; c < contract_.callbacks.size(); ++c) {
    const CallbackContract& stated = contract_.callbacks[c];
    if (stated.node != node || !stated.topic.empty()) continue;
    if (stated.timer >= number) return kNone;  // the contract states timers beyond this one
    const auto period = std::ranges::find(stated.terms, Clause::period, &Term::clause);
    const std::optional<Time>& last = states_[c].last;
    if (period == stated.terms.end() || period->limit != by.period.count()) continue;
    if (last && *last < by.created && (replaced == kNone || *last < *states_[replaced].last)) replaced = c;
  }
  return replaced;
}

void ContractCheck::started(const tracing::System& system, const tracing::Job& job,
                            std::optional<Time> timestamp) {
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  thread_check_.started(system, job, entry, incidents_);
  if (entry == kNone) return;
  const bool traced = job.has_sample && job.sample.parent.callback != kNone;
  chain_check_.started(entry, job, traced ? entry_of(system, job.sample.parent.callback) : kNone, timestamp);
  Subject& subject = subjects_[entry];
  subject.seen = true;
  const tracing::Callback& callback = system.callbacks[job.ref.callback];
  if (callback.kind == CallbackKind::service) return;  // no event tells of requests
  if (callback.depth > 0)                              // 0: keeps all, or unknown
    subject.compare(Clause::depth, callback.depth, job.start, incidents_);
  if (callback.kind == CallbackKind::timer) {
    subject.compare(Clause::period, callback.period.count(), job.start, incidents_);
    states_[entry].callback = job.ref.callback;
    arrived(entry, job.start);
  } else if (job.has_sample) {
    arrived(system, entry, job.ref.callback, job.sample);
  }
}

/// A timer's job started, or a sample was published.
void ContractCheck::arrived(std::uint32_t entry, Time at) {
  CallbackState& state = states_[entry];
  if (state.last && at < *state.last) return;  // published before samples that were taken earlier
  const bool ends_silence = state.silent && at > state.silent_since;
  JudgedTerm* const distance = subjects_[entry].find(Clause::maximum_distance);
  if (distance && state.last && lossless_) {
    if (ends_silence) {  // it may have been published before the silence was judged
      const Duration length = std::max(at, *state.silent) - state.silent_since;
      distance->judge_ended(state.silent_since, length, incidents_);
    } else {
      distance->compare((at - *state.last).count(), at, incidents_);
    }
  }
  state.last = at;
  if (ends_silence) state.silent.reset();
}

/// A sample was taken or overwritten.
void ContractCheck::arrived(const tracing::System& system, std::uint32_t entry, std::uint32_t callback,
                            const tracing::Sample& sample) {
  CallbackState& state = states_[entry];
  const std::uint32_t topic = names_.number_of(system, system.callbacks[callback].topic);
  const bool watched = sample.parent.callback != kNone;
  if (std::exchange(state.callback, callback) != callback) {  // its node was started again
    state.samples.clear();
    state.watched = false;
  }
  if (!watched && state.watched && topic != kNone && lossless_)
    publisher_check_.from_stranger(topic, sample.published, incidents_);
  state.watched = state.watched || watched;
  arrived(entry, sample.published);
  JudgedTerm* const distance = subjects_[entry].find(Clause::minimum_distance);
  if (distance == nullptr) return;
  if (!state.samples.empty() && (state.samples.back().sequence + 1 != sample.sequence || !lossless_))
    state.samples.clear();  // another subscription, or unknown ones between them
  std::vector<Duration> distances;
  for (auto before = state.samples.rbegin(); before != state.samples.rend(); ++before)
    distances.push_back(sample.published - before->published);
  distance->compare_distances(distances, sample.published, incidents_);
  state.samples.push_back(sample);
  if (state.samples.size() > distance->term().further.size() + 1) state.samples.pop_front();
}

void ContractCheck::published(const tracing::System& system, const tracing::Job& job,
                              const tracing::Publication& p) {
  const std::uint32_t topic = names_.number_of(system, p.topic);
  if (topic == kNone) return;
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  publisher_check_.published(system, job, topic, entry, entry == kNone ? nullptr : &subjects_[entry],
                             incidents_);
  if (entry != kNone) chain_check_.published(job, topic);
}

void ContractCheck::ended(const tracing::System& system, const tracing::Job& job, const RunningJob& ran) {
  thread_check_.ended(system, job);
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  if (entry == kNone) return;
  Subject& subject = subjects_[entry];
  const std::vector<ChainOutput>& outputs = chain_check_.ended(job);
  if (!job.ended || is_doubtful(job.start)) return;
  if (JudgedTerm* const budget = subject.find(Clause::budget)) {
    const Duration length = job.finish - job.start - ran.displaced;
    const ThreadKey thread = key_of(system.threads[job.thread]);
    if (ran.overdue) {
      budget->judge_ended(*ran.overdue, std::max(length, ran.judged), incidents_, thread);
    } else {
      budget->compare(length.count(), job.finish, incidents_, thread);
    }
  }
  if (JudgedTerm* const publishes = subject.find(Clause::publishes); publishes && job.published.empty())
    publishes->hold();
  if (ran.timestamp && (lossless_ || job.has_sample))  // a timer's is derived from its earlier jobs
    subject.compare(Clause::response, (job.finish - *ran.timestamp).count(), job.finish, incidents_);
  if (!lossless_) return;
  if (system.callbacks[job.ref.callback].kind != CallbackKind::service && states_[entry].lost == 0)
    subject.compare(Clause::lost, 0, job.finish, incidents_);
  for (const ChainOutput& output : outputs) judge(output);
}

void ContractCheck::judge(const ChainOutput& output) {
  Subject& chain = subjects_[contract_.callbacks.size() + output.chain];
  chain.seen = true;
  chain.compare(Clause::hot_path, output.hot_path.count(), output.start, incidents_);
  if (!output.age) return;
  chain.compare(Clause::age, output.age->count(), output.finish, incidents_);
  chain.compare(Clause::requirement, output.age->count(), output.finish, incidents_);
}

void ContractCheck::lost(const tracing::System& system, const tracing::LostSample& sample) {
  const std::uint32_t entry = entry_of(system, sample.subscription);
  if (entry == kNone || !lossless_) return;                   // its take may be among the lost events
  if (sample.subscription < states_[entry].callback) return;  // no event tells that this one has ended
  arrived(system, entry, sample.subscription, sample.sample);
  subjects_[entry].compare(Clause::lost, static_cast<std::int64_t>(++states_[entry].lost),
                           sample.sample.published, incidents_);
}

void ContractCheck::note_losses(std::uint64_t losses, Time until) {
  if (losses == losses_) return;
  losses_ = losses;
  lost_at_ = until;
  lossless_ = false;
}

void ContractCheck::observed_until(const tracing::System& system, RunningJobs& running, Time until,
                                   std::uint64_t losses) {
  constexpr auto kPause = std::chrono::milliseconds(100);
  constexpr auto kDoubt = std::chrono::seconds(5);
  note_losses(losses, until);
  lossless_ = !ending_ && (!lost_at_ || until > *lost_at_ + kDoubt);
  if (observed_until_ && until < *observed_until_ + kPause) return;
  observed_until_ = until;
  publisher_check_.created(system, names_, until, incidents_);
  judge_running(system, running, until);
  for (std::uint32_t entry = 0; lossless_ && entry < states_.size(); ++entry)
    judge_silence(system, entry, until);
}

void ContractCheck::judge_running(const tracing::System& system, RunningJobs& running, Time until) {
  for (RunningJob& job : running.all()) {
    const std::uint32_t entry = entry_of(system, job.ref.callback);
    JudgedTerm* const budget = entry == kNone ? nullptr : subjects_[entry].find(Clause::budget);
    if (budget == nullptr || job.overdue || is_doubtful(job.start)) continue;
    const std::optional<Time> start = running.undisplaced_start(job);
    if (!start || (until - *start).count() <= budget->term().limit) continue;
    job.overdue = start;
    job.judged = until - *start;
    budget->judge_lasting(*start, until, incidents_);
  }
}

void ContractCheck::judge_silence(const tracing::System& system, std::uint32_t entry, Time until) {
  CallbackState& state = states_[entry];
  JudgedTerm* const distance = subjects_[entry].find(Clause::maximum_distance);
  if (distance == nullptr || !state.last || state.silent) return;
  // Samples wait unread while another callback runs, and those of unwatched publishers are known only when
  // they are taken: only what nothing can explain is silence.
  const Time since = std::max(*state.last, system.callbacks[state.callback].published_for_it);
  if ((until - since).count() <= 2 * distance->term().limit) return;
  state.silent = until;
  state.silent_since = since;
  distance->judge_lasting(since, until, incidents_);
}

bool ContractCheck::settled(const Incident& incident) const {
  return contract_.threads.empty() || (thread_check_.at() && *thread_check_.at() >= incident.begin().at);
}

std::string ContractCheck::imported_chain(const std::string& name) const {
  const auto chain = std::ranges::find(contract_.chains, name, &ChainContract::name);
  std::string sources;
  for (const std::uint32_t source : chain->sources)
    sources += (sources.empty() ? "" : ",") + names_.imported(contract_.callbacks[source].node);
  return sources + ":" + names_.imported(contract_.callbacks[chain->sinks.front()].node);
}

}  // namespace hotpath::watch
