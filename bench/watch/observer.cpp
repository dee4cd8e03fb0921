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

void Observer::event(const tracing::Event& e) {
  ++events_;
  if (describes(e.kind) && ++entities_ > kMostEntities) {
    ++ignored_;
    return;
  }
  if (recorder_ != nullptr) recorder_->keep(e);
  assembler_.event(e);
}

CallbackObservation& Observer::of(std::uint32_t callback) {
  if (callback >= callbacks_.size()) callbacks_.resize(callback + 1);
  return callbacks_[callback];
}

std::optional<Time> Observer::timestamp_of(const tracing::Job& job, const tracing::Callback& callback,
                                           CallbackObservation& observed) {
  if (job.has_sample) return job.sample.published;
  if (callback.kind != tracing::CallbackKind::timer) return std::nullopt;
  std::optional<Timer>& timer = observed.timer;
  if (!timer) timer = timer_from(callback.created + callback.period, callback.period);
  const Time next = timer->next_call();
  if (next <= job.start) return timer->call(job.start).timestamp;
  if (next - job.start > kCreation) timer = timer_from(job.start, callback.period);
  return timer->call(std::max(timer->next_call(), job.start)).timestamp;
}

void Observer::ended(tracing::Job&& job) {
  if (!job.ended) return;
  CallbackObservation& observed = of(job.ref.callback);
  ++observed.jobs;
  observed.execution.add(job.finish - job.start);
  const std::optional<Time> timestamp = timestamp_of(job, system().callbacks[job.ref.callback], observed);
  if (timestamp) observed.response.add(job.finish - *timestamp);
  if (contract_ != nullptr) contract_->job(system(), job, timestamp);
}

void Observer::lost(const tracing::LostSample& sample) {
  if (!sample.queued) ++of(sample.subscription).lost;
}

}  // namespace hotpath::watch
