// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

void Assembler::on_rcl_publish(const Event& e) { publish(e, false); }
void Assembler::on_intra_publish(const Event& e) { publish(e, true); }

void Assembler::on_rmw_publish(const Event& e) {
  if (const ThreadState& thread = thread_of(e); thread.message == e.number[1]) stamp(thread, e.number[2]);
}

void Assembler::on_bind_stamp(const Event& e) { stamp(thread_of(e), e.number[1]); }

void Assembler::on_rmw_take(const Event& e) {
  if (e.number[3] != 0) take(e, find(rmw_subscriptions_, {e.process, e.number[0]}, kNone), e.number[2]);
}

void Assembler::on_dispatch_subscription_callback(const Event& e) {
  take(e, find(callbacks_, {e.process, e.number[0]}, kNone), e.number[1]);
}

void Assembler::publish(const Event& e, bool intra_process) {
  const std::uint32_t publisher = find(publishers_, {e.process, e.number[0]}, kNone);
  if (publisher == kNone) return;
  const std::uint32_t topic = system_.endpoints[publisher].topic;
  ThreadState& thread = thread_of(e);
  // A call of publish() for both is one publication: first within the process, then between them.
  const bool continued = !intra_process && thread.intra_published && thread.publisher == publisher;
  thread.intra_published = intra_process;
  thread.message = e.number[1];
  if (!continued) {
    // Between two questions for the next callback, only a callback publishes.
    if (thread.open.empty() && thread.asked) begin_unannounced(e, thread);
    thread.publisher = publisher;
    thread.publication = ++publications_;
    thread.reached.clear();
    ++system_.endpoints[publisher].publications;
    thread.topic = topic;
    if (!thread.open.empty()) {
      Job& job = thread.open.back();
      if (bounded() && job.published.size() == kMostPublished) job.published.pop_back();
      job.published.push_back({topic, e.at, events_});
      sink_.published(job, job.published.back());
    }
  }
  if (intra_process) return;
  for (const std::uint32_t subscription : system_.topics[thread.topic].subscriptions)
    if (std::ranges::count(thread.reached, subscription) == 0) deliver(e, subscription, thread, std::nullopt);
}

void Assembler::deliver(const Event& e, std::uint32_t subscription, const ThreadState& thread,
                        std::optional<std::uint64_t> slot) {
  CallbackState& state = callback_states_[subscription];
  const bool delivered = !state.unread.empty() && state.unread.back().publication == thread.publication;
  if (delivered) return;
  const JobRef parent = thread.open.empty() ? JobRef{} : thread.open.back().ref;
  state.unread.push_back(
      {{state.samples++, e.at, parent}, thread.publication, thread.publisher, 0, slot, false});
  Callback& callback = system_.callbacks[subscription];
  ++callback.samples;
  callback.published_for_it = e.at;
  if (state.unread.size() > (callback.depth > 0 ? callback.depth : kKeepAll)) overflow(subscription);
}

/// Removes an unread sample: one that was passed, or else the oldest, which is lost. In a running
/// system, it counts only if the subscription surely lives, and had been discovered by the publisher.
void Assembler::overflow(std::uint32_t subscription) {
  CallbackState& state = callback_states_[subscription];
  auto sample = std::ranges::find(state.unread, true, &Unread::passed);
  if (sample == state.unread.end()) {
    sample = state.unread.begin();
    const bool discovered = sample->slot || state.taken_from.contains(sample->publisher) ||
                            system_.endpoints[sample->publisher].process == state.process;
    if (!bounded() || (discovered && !state.doubtful)) sink_.lost({subscription, sample->sample, false});
  }
  state.unread.erase(sample);
}

/// Sets the source timestamp that readers will report of the thread's latest publication.
void Assembler::stamp(const ThreadState& thread, std::uint64_t source_ns) {
  if (thread.topic == kNone) return;
  for (const std::uint32_t subscription : system_.topics[thread.topic].subscriptions) {
    std::deque<Unread>& unread = callback_states_[subscription].unread;
    if (unread.empty() || unread.back().publication != thread.publication) continue;
    if (unread.back().source_ns == 0) unread.back().source_ns = source_ns;
  }
}

void Assembler::take(const Event& e, std::uint32_t subscription, std::uint64_t source_ns) {
  if (subscription == kNone) return;
  const Time source{Duration(static_cast<std::int64_t>(source_ns))};
  std::deque<Unread>& unread = callback_states_[subscription].unread;
  auto sample = std::ranges::find(unread, source_ns, &Unread::source_ns);
  if (sample == unread.end()) {
    // Humble's publications have no timestamps; the middleware sets one right after their event.
    const auto distance = [&](const Unread& u) { return std::chrono::abs(source - u.sample.published); };
    const auto nearest = std::ranges::min_element(unread, {}, distance);
    const bool near = nearest != unread.end() && nearest->source_ns == 0 &&
                      distance(*nearest) < std::chrono::milliseconds(1);
    if (near) sample = nearest;
  }
  ThreadState& thread = thread_of(e);
  if (sample != unread.end()) {
    hold(thread, subscription, sample);
  } else {
    thread.taken_by = subscription;
    thread.taken = stranger(subscription, std::min(source, e.at));
  }
  if (system_.callbacks[subscription].of_action && thread.open.empty() && thread.asked)
    begin_unannounced(thread, subscription, *thread.asked, thread.asked_at, {});
}

void Assembler::hold(ThreadState& thread, std::uint32_t subscription,
                     const std::deque<Unread>::iterator& sample) {
  thread.taken_by = subscription;
  thread.taken = sample->sample;
  CallbackState& state = callback_states_[subscription];
  state.doubtful = false;
  if (bounded()) {
    state.taken_from.insert(sample->publisher);
    // They never arrived, unless another thread has taken them and its event follows.
    for (auto older = state.unread.begin(); older != sample; ++older)
      older->passed = older->passed || older->publisher == sample->publisher;
  }
  state.unread.erase(sample);
}

Sample Assembler::stranger(std::uint32_t subscription, Time published) {
  ++system_.callbacks[subscription].strangers;
  ++system_.callbacks[subscription].samples;
  return {callback_states_[subscription].samples++, published, {}};
}

void Assembler::on_ring_buffer_enqueue(const Event& e) {
  const std::uint32_t subscription = subscription_behind({e.process, e.number[0]});
  ThreadState& thread = thread_of(e);
  if (subscription == kNone || thread.topic != system_.callbacks[subscription].topic) return;
  deliver(e, subscription, thread, e.number[1]);
  // Another thread may take the sample before rcl publishes it.
  if (std::ranges::count(thread.reached, subscription) == 0) thread.reached.push_back(subscription);
}

void Assembler::on_ring_buffer_dequeue(const Event& e) {
  const std::uint32_t subscription = subscription_behind({e.process, e.number[0]});
  if (subscription == kNone) return;
  system_.callbacks[subscription].intra_process = true;
  std::deque<Unread>& unread = callback_states_[subscription].unread;
  const auto sample = std::ranges::find(unread, std::optional(e.number[1]), &Unread::slot);
  if (sample != unread.end()) hold(thread_of(e), subscription, sample);
}

std::uint32_t Assembler::subscription_behind(Handle buffer) const {
  const Handle ipb{buffer.process, find(ipb_of_buffer_, buffer, std::uint64_t{0})};
  const Handle rclcpp{buffer.process, find(subscription_of_ipb_, ipb, std::uint64_t{0})};
  return find(rclcpp_subscriptions_, rclcpp, kNone);
}

}  // namespace hotpath::tracing
