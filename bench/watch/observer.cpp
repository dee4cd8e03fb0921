// SPDX-License-Identifier: Apache-2.0
#include "watch/observer.hpp"

#include <algorithm>

#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

namespace {

/// The event of a timer's creation follows the reading of the clock from which its period counts.
/// A job that starts earlier than this before its timestamp shows that the timer was reset.
constexpr Duration kCreation = std::chrono::milliseconds(1);

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
  if (next <= job.start) return timer->call(job.start).timestamp;
  if (next - job.start > kCreation) timer = timer_from(job.start, callback.period);
  return timer->call(std::max(timer->next_call(), job.start)).timestamp;
}

void Observer::observed_until(Time until, const Losses& losses) {
  if (contract_ != nullptr)
    contract_->observed_until(system(), until, losses.dropped + losses.damaged + losses.late);
}

void Observer::next_interval() {
  for (CallbackObservation& callback : callbacks_) callback.latest = Duration(-1);
  if (contract_ != nullptr) contract_->next_interval();
}

void Observer::started(const tracing::Job& job) {
  const std::optional<Time> timestamp =
      timestamp_of(job, system().callbacks[job.ref.callback], of(job.ref.callback));
  open_.push_back({job.ref, timestamp});
  if (contract_ != nullptr) contract_->started(system(), job, timestamp);
}

void Observer::published(const tracing::Job& job, const tracing::Publication& publication) {
  if (contract_ != nullptr) contract_->published(system(), job, publication);
}

void Observer::ended(tracing::Job&& job) {
  std::optional<Time> timestamp;
  const auto open = std::ranges::find_if(open_, [&](const Open& o) {
    return o.ref.callback == job.ref.callback && o.ref.number == job.ref.number;
  });
  if (open != open_.end()) {
    timestamp = open->timestamp;
    open_.erase(open);
  }
  if (job.ended) {
    CallbackObservation& observed = of(job.ref.callback);
    ++observed.jobs;
    observed.execution.add(job.finish - job.start);
    observed.latest = std::max(observed.latest, job.finish - job.start);
    if (timestamp) observed.response.add(job.finish - *timestamp);
  }
  if (contract_ != nullptr) contract_->ended(system(), job, timestamp);
}

void Observer::lost(const tracing::LostSample& sample) {
  if (sample.queued) return;
  ++of(sample.subscription).lost;
  if (contract_ != nullptr) contract_->lost(system(), sample);
}

}  // namespace hotpath::watch
