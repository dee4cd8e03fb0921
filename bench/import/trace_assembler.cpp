// SPDX-License-Identifier: Apache-2.0
#include "import/trace_assembler.hpp"

#include <algorithm>
#include <utility>

namespace hotpath {

namespace {

/// Most nested callbacks of a thread, as when a callback spins.
constexpr std::size_t kMostNested = 16;

}  // namespace

void TraceAssembler::visit(const TraceEvent& e) {
  using K = TraceEventKind;
  ++events_;
  if (describe(e)) return;
  switch (e.kind) {
    case K::callback_start:
      return start(e);
    case K::callback_end:
      return end(e);
    case K::rcl_publish:
      return publish(e, false);
    case K::intra_publish:
      return publish(e, true);
    case K::rmw_publish:
    case K::bind_stamp:
      return stamp(e);
    case K::rmw_take:
      if (e.number[2] != 0) take(e, rmw_subscriptions_);
      return;
    case K::dispatch_subscription_callback:
      return take(e, callbacks_);
    case K::ring_buffer_enqueue:
      return enqueue(e);
    case K::ring_buffer_dequeue:
      return dequeue(e);
    case K::wait_for_work: {
      const std::uint32_t thread = thread_index(e);
      threads_[thread].waited = true;
      ++system_.threads[thread].waits;
      return;
    }
    default:
      return;
  }
}

void TraceAssembler::start(const TraceEvent& e) {
  const auto [at, is_new] =
      callbacks_.try_emplace({e.process, e.number[0]}, static_cast<std::uint32_t>(system_.callbacks.size()));
  if (is_new) system_.callbacks.emplace_back();
  const std::uint32_t callback = at->second;
  numbers_.resize(std::max(numbers_.size(), system_.callbacks.size()));
  const std::uint32_t index = thread_index(e);
  Thread& thread = threads_[index];
  // A callback cannot contain itself: its end was lost.
  const auto same = [&](const RecordedJob& job) { return job.ref.callback == callback; };
  if (std::ranges::any_of(thread.open, same) || thread.open.size() == kMostNested) {
    for (RecordedJob& job : thread.open) give_up(job);
    thread.open.clear();
  }
  RecordedJob& job = thread.open.emplace_back();
  job.ref = {callback, numbers_[callback]++};
  job.thread = index;
  job.start = from_ns(e.at_ns);
  job.started = events_;
  job.waited = std::exchange(thread.waited, false);
  if (thread.taken_by == callback) {
    job.has_sample = true;
    job.sample = thread.taken;
  } else if (RecordedCallback& c = system_.callbacks[callback]; c.kind == RecordedKind::subscription) {
    readers_.resize(std::max(readers_.size(), system_.callbacks.size()));
    auto& unread = readers_[callback].unread;
    // Without an event of its take (Humble within a process) the job has the oldest unread sample.
    if (e.number[1] != 0 && !unread.empty()) {
      hold(thread, callback, unread.begin());
      job.sample = thread.taken;
    } else {
      ++c.strangers;
      ++c.samples;
      job.sample = {readers_[callback].sequence++, job.start, {}};
    }
    job.has_sample = true;
  }
  thread.taken_by = kNone;
}

void TraceAssembler::end(const TraceEvent& e) {
  const std::uint32_t index = thread_index(e);
  Thread& thread = threads_[index];
  const auto known = callbacks_.find({e.process, e.number[0]});
  const auto matches = [&](const RecordedJob& job) {
    return known != callbacks_.end() && job.ref.callback == known->second;
  };
  const auto begun = std::ranges::find_if(thread.open, matches);
  if (begun == thread.open.end()) {
    ++system_.ends_without_start;
    return;
  }
  for (auto inner = std::next(begun); inner != thread.open.end(); ++inner) give_up(*inner);
  RecordedJob job = std::move(*begun);
  thread.open.erase(begun, thread.open.end());
  job.finish = from_ns(e.at_ns);
  job.finished = events_;
  job.processor = e.processor;
  RecordedCallback& callback = system_.callbacks[job.ref.callback];
  ++callback.jobs;
  callback.busy += job.finish - job.start;
  ++callback.threads[index];
  ++system_.threads[index].jobs;
  ++system_.threads[index].processors[e.processor];
  for (const RecordedPublication& p : job.published) ++callback.published[p.topic];
  sink_.ended(std::move(job));
}

void TraceAssembler::give_up(RecordedJob& job) {
  ++system_.callbacks[job.ref.callback].never_ended;
  job.ended = false;
  sink_.ended(std::move(job));
}

void TraceAssembler::finish() {
  for (Thread& thread : threads_) {
    for (RecordedJob& job : thread.open) give_up(job);
    thread.open.clear();
  }
  for (std::uint32_t subscription = 0; subscription < readers_.size(); ++subscription) {
    for (const Unread& unread : readers_[subscription].unread) sink_.lost(subscription, unread.sample, true);
  }
}

std::uint32_t TraceAssembler::thread_index(const TraceEvent& e) {
  const auto [at, is_new] =
      thread_indices_.try_emplace(Handle{e.process, e.thread}, static_cast<std::uint32_t>(threads_.size()));
  if (is_new) {
    threads_.emplace_back();
    RecordedThread& thread = system_.threads.emplace_back();
    thread.process = e.process;
    thread.id = e.thread;
  }
  return at->second;
}

}  // namespace hotpath
