// SPDX-License-Identifier: Apache-2.0
#include "watch/observer.hpp"

#include <algorithm>

#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

namespace {

/// The event of a timer's creation follows the reading of the clock from which its period counts.
/// A job that starts earlier than this before its timestamp shows that the timer was reset.
constexpr Duration kCreation = std::chrono::milliseconds(1);

/// A thread that runs nothing for longer has nothing to run.
constexpr Duration kIdle = std::chrono::microseconds(100);

Timer timer_from(Time first, Duration period) {
  Task task;
  task.period = period;
  return {0, task, first};
}

}  // namespace

void Observer::event(tracing::Event e) {
  ++events_;
  if (e.kind == tracing::EventKind::rmw_publish && e.number[2] == 0) unstamped_.insert(e.process);
  if (e.kind == tracing::EventKind::rmw_take && unstamped_.contains(e.process))
    e.number[2] -= static_cast<std::uint64_t>(realtime_.count());  // the clock of publications
  if (e.kind == tracing::EventKind::wait_for_work) {
    Rounds& rounds = rounds_[{e.process, e.thread}];
    rounds.waits = true;
    if (rounds.open == 0) rounds.next(e.at);  // or else it is another executor's, in a callback
  }
  if (recorder_ != nullptr) recorder_->keep(e);
  assembler_.event(e);
}

CallbackObservation& Observer::of(std::uint32_t callback) {
  if (callback >= callbacks_.size()) callbacks_.resize(callback + 1);
  return callbacks_[callback];
}

std::optional<Time> Observer::timestamp_of(const tracing::Job& job, const tracing::Callback& callback,
                                           CallbackObservation& observed) const {
  const bool service = callback.kind == tracing::CallbackKind::service;
  if (job.has_sample && !service) return job.sample.published;
  if (!service && callback.kind != tracing::CallbackKind::timer) return std::nullopt;
  if (job.timestamp > Time{} && job.timestamp <= job.start) return job.timestamp;  // hotpath's executors
  if (service) return std::nullopt;
  std::optional<Timer>& timer = observed.timer;
  if (!timer || observed.created != callback.created) {
    observed.created = callback.created;
    Time first = callback.created + callback.period;
    if (attached_ && callback.created < *attached_ && first < job.start)
      first += (job.start - first) / callback.period * callback.period;
    timer = timer_from(first, callback.period);
  }
  const Time next = timer->next_call();
  const bool in_time = job.start - next <= callback.period;
  const std::optional<bool> late = in_time ? true : is_late(job, next, callback.period);
  if (late != true || next - job.start > kCreation) timer = timer_from(job.start, callback.period);
  const Time timestamp = timer->call(std::max(timer->next_call(), job.start)).timestamp;
  return late ? std::optional(timestamp) : std::nullopt;
}

/// A wait returns at once if a timer is due, whose job then starts before the next wait: after two waits
/// it was not due. Where several threads wait, its callback group may be blocked meanwhile.
std::optional<bool> Observer::is_late(const tracing::Job& job, Time due, Duration period) const {
  const auto thread = rounds_.find(key_of(system().threads[job.thread]));
  const Rounds& rounds = thread->second;
  const bool at_once = rounds.last_job - rounds.last <= period / 2;
  const bool ran_earlier = rounds.earlier_job > Time{} && rounds.earlier_job <= due;
  if (due >= rounds.last ? rounds.last_job <= due : due >= rounds.earlier && ran_earlier && at_once)
    return true;
  const auto waits = [&](const auto& other) {
    return other.first.first == thread->first.first && other.second.waits;
  };
  const bool alone = rounds.waits && std::ranges::count_if(rounds_, waits) == 1;
  return due < rounds.earlier && alone ? std::optional(false) : std::nullopt;
}

void Observer::observed_until(Time until, const Losses& losses) {
  if (contract_ != nullptr) contract_->observed_until(system(), running_, until, losses.total());
}

void Observer::started(const tracing::Job& job) {
  Rounds& rounds = rounds_[key_of(system().threads[job.thread])];
  if (!rounds.waits && rounds.open == 0 && job.start - rounds.finish > kIdle) rounds.next(rounds.finish);
  if (rounds.last_job == Time{}) rounds.last_job = job.start;
  ++rounds.open;
  const std::optional<Time> timestamp =
      timestamp_of(job, system().callbacks[job.ref.callback], of(job.ref.callback));
  running_.start(job, timestamp);
  if (contract_ != nullptr) contract_->started(system(), job, timestamp);
}

void Observer::published(const tracing::Job& job, const tracing::Publication& publication) {
  if (contract_ != nullptr) contract_->published(system(), job, publication);
}

void Observer::ended(tracing::Job&& job) {
  const RunningJob ran = running_.end(job);
  Rounds& rounds = rounds_[key_of(system().threads[job.thread])];
  if (rounds.open > 0) --rounds.open;
  rounds.finish = std::max(rounds.finish, job.finish);
  if (job.ended) {
    CallbackObservation& observed = of(job.ref.callback);
    observed.execution.add(job.finish - job.start);
    if (ran.timestamp) observed.response.add(job.finish - *ran.timestamp);
  }
  if (contract_ != nullptr) contract_->ended(system(), job, ran);
}

void Observer::lost(const tracing::LostSample& sample) {
  if (sample.queued) return;
  ++of(sample.subscription).lost;
  if (contract_ != nullptr) contract_->lost(system(), sample);
}

}  // namespace hotpath::watch
