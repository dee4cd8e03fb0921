// SPDX-License-Identifier: Apache-2.0
#include "watch/observer.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

Observer::Observer(Contract contract, FlightRecorder* recorder, Duration realtime,
                   std::optional<Time> attached)
    : contract_(std::move(contract)),
      recorder_(recorder),
      judge_(contract_, names_.topics(), realtime),
      timestamps_(attached),
      states_(contract_.callbacks.size()) {}

void Observer::event(tracing::Event e) {
  ++events_;
  if (e.kind == tracing::EventKind::rmw_publish && e.number[2] == 0) unstamped_.insert(e.process);
  if (e.kind == tracing::EventKind::rmw_take && unstamped_.contains(e.process))  // the clock of publications
    e.number[2] -= static_cast<std::uint64_t>(judge_.incidents().realtime().count());
  if (e.kind == tracing::EventKind::wait_for_work) timestamps_.waits({e.process, e.thread}, e.at);
  if (recorder_ != nullptr) recorder_->keep(e);
  assembler_.event(e);
}

CallbackObservation& Observer::of(std::uint32_t callback) {
  if (callback >= callbacks_.size()) callbacks_.resize(callback + 1);
  return callbacks_[callback];
}

void Observer::started(const tracing::Job& job) {
  const tracing::Thread& thread = system().threads[job.thread];
  const auto timestamp = timestamps_.start(job, system().callbacks[job.ref.callback], key_of(thread));
  running_.start(job, timestamp);
  const std::uint32_t entry = names_.entry_of(job.ref.callback);
  thread_check_.started(job, entry);
  if (job.has_sample) confirm_losses(job.ref.callback);
  if (entry == kNone) return;
  Process& process = processes_.try_emplace(thread.process).first->second;
  process.nodes.insert(contract_.callbacks[entry].node);
  process.finish = std::max(process.finish, job.start);
  const bool traced = job.has_sample && job.sample.parent.callback != kNone;
  chain_check_.started(entry, job, traced ? names_.entry_of(job.sample.parent.callback) : kNone, timestamp);
  judge_start(entry, job);
}

void Observer::judge_start(std::uint32_t entry, const tracing::Job& job) {
  Subject& subject = judge_.callback(entry);
  if (!std::exchange(subject.seen, true)) grown_ = job.start;
  states_[entry].waited_for.reset();
  states_[entry].stands = false;
  const tracing::Callback& callback = system().callbacks[job.ref.callback];
  if (callback.kind == CallbackKind::service) return arrived(entry, job.start);  // no event tells of requests
  if (callback.depth > 0) subject.compare(Clause::depth, callback.depth, job.start);  // 0: all, or unknown
  if (callback.kind == CallbackKind::timer) {
    subject.compare(Clause::period, callback.period.count(), job.start);
    states_[entry].callback = job.ref.callback;
    names_.timer_ran(entry, job.start);
    arrived(entry, job.start);
  } else if (job.has_sample) {
    arrived(entry, job.ref.callback, job.sample);
  }
}

/// A timer's job started, or a sample was published.
void Observer::arrived(std::uint32_t entry, Time at) {
  CallbackState& state = states_[entry];
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
void Observer::arrived(std::uint32_t entry, std::uint32_t callback, const tracing::Sample& sample) {
  CallbackState& state = states_[entry];
  const std::uint32_t topic = names_.number_of(system().callbacks[callback].topic);
  const bool watched = sample.parent.callback != kNone;
  if (std::exchange(state.callback, callback) != callback) {  // its node was started again
    state.samples.clear();
    state.watched = false;
  }
  if (!watched && state.watched && topic != kNone && lossless_)
    judge_publisher(topic, false, "is also published by a node that is not watched, or outside of callbacks",
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

void Observer::published(const tracing::Job& job, const tracing::Publication& p) {
  const std::uint32_t topic = names_.number_of(p.topic);
  if (topic == kNone) return;
  const std::uint32_t entry = names_.entry_of(job.ref.callback);
  const std::string& name = names_.topics()[topic];
  const bool known = entry != kNone && contract_.callbacks[entry].may_publish(name);
  JudgedTerm* const publishes = entry == kNone ? nullptr : judge_.callback(entry).find(Clause::publishes);
  const auto messages = std::ranges::count(job.published, p.topic, &tracing::Publication::topic);
  if (publishes == nullptr && !known) {
    const std::string node = node_name(system(), system().callbacks[job.ref.callback].node);
    judge_publisher(topic, false, "is also published by " + node, p.at);
  } else if (publishes != nullptr && known && messages == 1) {
    publishes->hold();
  } else if (publishes != nullptr) {
    publishes->judge(false,
                     known ? program::concat("published ", messages, " messages of ", name, " in one job")
                           : "published " + name + ", which the contract lacks",
                     p.at);
  }
  if (entry != kNone) chain_check_.published(job, topic);
}

void Observer::judge_publisher(std::uint32_t topic, bool known, const std::string& observed, Time at) {
  judge_.all(Kind::topic)[topic].terms.front().judge(known, observed, at);
}

void Observer::ended(tracing::Job&& job) {
  const RunningJob ran = running_.end(job);
  timestamps_.end(job, key_of(system().threads[job.thread]));
  if (job.ended) {
    CallbackObservation& observed = of(job.ref.callback);
    observed.execution.add(job.finish - job.start);
    if (ran.timestamp) observed.response.add(job.finish - *ran.timestamp);
    remember(job);
  }
  const std::uint32_t entry = names_.entry_of(job.ref.callback);
  if (entry == kNone) return;
  const bool judged = job.ended && !is_doubtful(job.start);
  if (judged) judge_run(entry, job, ran);
  chain_check_.ended(job, judged && lossless_);
}

void Observer::judge_run(std::uint32_t entry, const tracing::Job& job, const RunningJob& ran) {
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
  const bool service = system().callbacks[job.ref.callback].kind == CallbackKind::service;
  if (lossless_ && !service && states_[entry].lost == 0) subject.compare(Clause::lost, 0, job.finish);
}

void Observer::remember(const tracing::Job& job) {
  constexpr Duration kLength = std::chrono::seconds(5);
  constexpr std::size_t kMost = 10'000;
  past_jobs_.push_back({job.ref.callback, job.start, job.finish});
  while (past_jobs_.size() > kMost || past_jobs_.front().finish + kLength < job.finish)
    past_jobs_.pop_front();
  const auto process = processes_.find(system().threads[job.thread].process);
  if (process != processes_.end()) process->second.finish = std::max(process->second.finish, job.finish);
}

void Observer::set_realtime(Duration offset, Time at) {
  constexpr Duration kStep = std::chrono::milliseconds(50);  // time servers slew it by less
  const Duration step = offset - judge_.incidents().realtime();
  if (begin_ && std::chrono::abs(step) >= kStep)
    judge_.incidents().add({Role::clock, at,
                            std::string("the clock was set ") + (step > Duration{} ? "forward" : "back") +
                                " by " + shown_ms(std::chrono::abs(step))});
  judge_.incidents().set_realtime(offset);
}

void Observer::lost(const tracing::LostSample& sample) {
  constexpr std::size_t kMost = 1'000;
  if (std::vector<tracing::LostSample>& unsure = unsure_[sample.subscription];
      !sample.queued && unsure.size() < kMost)
    unsure.push_back(sample);
}

/// The subscription takes a sample.
void Observer::confirm_losses(std::uint32_t callback) {
  if (const auto samples = unsure_.extract(callback))
    for (const tracing::LostSample& sample : samples.mapped()) judge_lost(sample);
}

void Observer::judge_lost(const tracing::LostSample& sample) {
  ++of(sample.subscription).lost;
  const std::uint32_t entry = names_.entry_of(sample.subscription);
  if (entry == kNone || !lossless_ || is_doubtful(sample.sample.published)) return;  // or its take was lost
  if (sample.subscription < states_[entry].callback) return;  // no event tells that this one has ended
  arrived(entry, sample.subscription, sample.sample);
  const auto lost = static_cast<std::int64_t>(++states_[entry].lost);
  judge_.callback(entry).compare(Clause::lost, lost, sample.sample.published);
}

/// The longest jobs from `since` until then, except those of the callback.
std::vector<Fact> Observer::jobs(Time since, Time until, const std::string& except) {
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

std::vector<Incident*> Observer::describe(bool at_end) {
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

}  // namespace hotpath::watch
