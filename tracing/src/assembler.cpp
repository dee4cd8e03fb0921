// SPDX-License-Identifier: Apache-2.0
#include "hotpath/tracing/assembler.hpp"

#include <algorithm>
#include <utility>

namespace hotpath::tracing {

namespace {

/// Most nested callbacks of a thread, as when a callback spins.
constexpr std::size_t kMostNested = 16;

}  // namespace

void Assembler::event(const Event& e) {
#define HOTPATH_HANDLER(kind, ...) &Assembler::on_##kind,
  static constexpr void (Assembler::*kHandlers[])(const Event&) = {HOTPATH_EVENTS(HOTPATH_HANDLER)};
#undef HOTPATH_HANDLER
  ++events_;
  if (format_of(e.kind).role == EventRole::describes && full()) {
    ++system_.ignored;
    return;
  }
  (this->*kHandlers[static_cast<std::size_t>(e.kind)])(e);
}

// Other programs read these.
void Assembler::on_rclcpp_publish(const Event&) {}
void Assembler::on_rcl_take(const Event&) {}
void Assembler::on_rclcpp_take(const Event&) {}
void Assembler::on_incident(const Event&) {}

void Assembler::on_callback_start(const Event& e) {
  const Handle handle{e.process, e.number[0]};
  if (!callbacks_.contains(handle)) {
    if (bounded() && unknown_ == kMostUnknown) {
      ++system_.ignored;
      return;
    }
    ++unknown_;
    callbacks_[handle] = add_callback(CallbackKind::unknown);
  }
  const std::uint32_t callback = callbacks_[handle];
  CallbackState& state = callback_states_[callback];
  ThreadState& thread = thread_of(e);
  thread.asked.reset();
  // A callback cannot contain itself: its end was lost.
  const auto same = [&](const Job& job) { return job.ref.callback == callback; };
  if (std::ranges::any_of(thread.open, same) || thread.open.size() == kMostNested) {
    give_up(thread.open, 0);
    thread.unannounced = false;
  }
  Job& job = thread.open.emplace_back();
  job.ref = {callback, state.jobs++};
  job.thread = thread.index;
  job.processor = e.processor;
  job.start = e.at;
  job.started = events_;
  job.decided = std::exchange(thread.question, {});
  job.question = thread.asked_at;
  job.waited = std::exchange(thread.waited, false);
  job.timestamp = std::exchange(thread.timestamp, {});
  job.release = std::exchange(thread.release, {});
  job.has_sample = true;
  if (std::exchange(thread.taken_by, kNone) == callback) {
    job.sample = thread.taken;
    // NOLINTNEXTLINE(bugprone-branch-clone): the order of the conditions matters
  } else if (system_.callbacks[callback].kind == CallbackKind::service) {
    // Its request is not traced, but an executor may state its arrival.
    job.sample = stranger(callback, job.timestamp > Time{} ? std::min(job.timestamp, e.at) : e.at);
  } else if (system_.callbacks[callback].kind != CallbackKind::subscription) {
    job.has_sample = false;
  } else if (e.number[1] != 0 && !state.unread.empty()) {
    // Without an event of its take (Humble within a process) the job has the oldest unread sample.
    job.sample = state.unread.front().sample;
    state.unread.pop_front();
  } else {
    job.sample = stranger(callback, e.at);
  }
  sink_.started(job);
}

void Assembler::on_callback_end(const Event& e) {
  ThreadState& thread = thread_of(e);
  const std::uint32_t callback_index = find(callbacks_, {e.process, e.number[0]}, kNone);
  const auto matches = [&](const Job& job) { return job.ref.callback == callback_index; };
  const auto begun = std::ranges::find_if(thread.open, matches);
  if (begun == thread.open.end()) {
    ++system_.ends_without_start;
    return;
  }
  give_up(thread.open, static_cast<std::size_t>(begun - thread.open.begin()) + 1);
  close(e, thread);
}

/// Ends the innermost job of the thread.
void Assembler::close(const Event& e, ThreadState& thread) {
  Job job = std::move(thread.open.back());
  thread.open.pop_back();
  job.finish = e.at;
  job.finished = events_;
  job.processor = e.processor;
  if (system_.callbacks[job.ref.callback].kind == CallbackKind::service) respond(e, job);
  Callback& callback = system_.callbacks[job.ref.callback];
  ++callback.jobs;
  callback.busy += job.finish - job.start;
  ++callback.threads[thread.index];
  ++system_.threads[thread.index].jobs;
  ++system_.threads[thread.index].processors[e.processor];
  for (const Publication& p : job.published) ++callback.published[p.topic];
  sink_.ended(std::move(job));
}

/// Passes the innermost jobs, from position `from` on, to the sink without their ends.
void Assembler::give_up(std::vector<Job>& open, std::size_t from) {
  for (std::size_t i = from; i < open.size(); ++i) {
    ++system_.callbacks[open[i].ref.callback].never_ended;
    open[i].ended = false;
    sink_.ended(std::move(open[i]));
  }
  open.resize(from);
}

void Assembler::finish() {
  for (ThreadState& thread : threads_) give_up(thread.open, 0);
  for (std::uint32_t c = 0; c < callback_states_.size(); ++c)
    for (const Unread& unread : callback_states_[c].unread) sink_.lost({c, unread.sample, true});
}

}  // namespace hotpath::tracing
