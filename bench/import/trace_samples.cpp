// SPDX-License-Identifier: Apache-2.0
// Matches the samples of jobs with publications.
#include "import/trace_assembler.hpp"

#include <algorithm>
#include <cstdlib>

namespace hotpath {

void TraceAssembler::publish(const TraceEvent& e, bool intra_process) {
  const auto known = publishers_.find({e.process, e.number[0]});
  if (known == publishers_.end()) return;
  Thread& thread = threads_[thread_index(e)];
  // A call of publish() for both is one publication: first within the process, then between them.
  const bool continued = !intra_process && thread.intra_published && thread.publisher == e.number[0];
  thread.intra_published = intra_process;
  thread.message = e.number[1];
  if (!continued) {
    thread.publisher = e.number[0];
    thread.publication = ++publications_;
    thread.topic = known->second;
    if (!thread.open.empty()) {
      thread.open.back().published.push_back({thread.topic, from_ns(e.at_ns), events_});
    }
  }
  if (intra_process) return;
  for (const std::uint32_t subscription : system_.topics[thread.topic].subscriptions)
    deliver(e, subscription, thread, false);
}

void TraceAssembler::deliver(const TraceEvent& e, std::uint32_t subscription, const Thread& thread,
                             bool intra_process) {
  readers_.resize(std::max(readers_.size(), system_.callbacks.size()));
  Readers& readers = readers_[subscription];
  const bool delivered = !readers.unread.empty() && readers.unread.back().publication == thread.publication;
  if (delivered) return;
  Unread& unread = readers.unread.emplace_back();
  unread.sample = {readers.sequence++, from_ns(e.at_ns),
                   thread.open.empty() ? RecordedRef{} : thread.open.back().ref};
  unread.publication = thread.publication;
  unread.intra_process = intra_process;
  if (intra_process) unread.slot = e.number[1];
  ++system_.callbacks[subscription].samples;
  const std::uint32_t depth = system_.callbacks[subscription].depth;
  if (readers.unread.size() <= (depth > 0 ? depth : kKeepAll)) return;
  sink_.lost(subscription, readers.unread.front().sample, false);
  readers.unread.pop_front();
}

/// Sets the source timestamp that readers will report.
void TraceAssembler::stamp(const TraceEvent& e) {
  const Thread& thread = threads_[thread_index(e)];
  const bool of_message = e.kind == TraceEventKind::bind_stamp || thread.message == e.number[0];
  if (thread.topic == kNone || !of_message || e.number[1] == 0) return;
  for (const std::uint32_t subscription : system_.topics[thread.topic].subscriptions) {
    if (subscription >= readers_.size() || readers_[subscription].unread.empty()) continue;
    Unread& unread = readers_[subscription].unread.back();
    if (unread.publication == thread.publication && unread.source_ns == 0) unread.source_ns = e.number[1];
  }
}

void TraceAssembler::take(const TraceEvent& e, const ByHandle<std::uint32_t>& subscriptions) {
  const auto known = subscriptions.find({e.process, e.number[0]});
  if (known == subscriptions.end()) return;
  const std::uint32_t subscription = known->second;
  const std::uint64_t source_ns = e.number[1];
  readers_.resize(std::max(readers_.size(), system_.callbacks.size()));
  auto& unread = readers_[subscription].unread;
  auto sample = std::ranges::find(unread, source_ns, &Unread::source_ns);
  if (sample == unread.end()) {
    // Humble's publications have no timestamps; the middleware sets one right after their event.
    const auto distance = [&](const Unread& u) {
      return std::abs(static_cast<std::int64_t>(source_ns) - to_ns(u.sample.published));
    };
    const auto nearest = std::ranges::min_element(unread, {}, distance);
    const bool near = nearest != unread.end() && nearest->source_ns == 0 && distance(*nearest) < 1'000'000;
    if (near) sample = nearest;
  }
  Thread& thread = threads_[thread_index(e)];
  if (sample != unread.end()) return hold(thread, subscription, sample);
  ++system_.callbacks[subscription].strangers;
  ++system_.callbacks[subscription].samples;
  thread.taken_by = subscription;
  thread.taken = {readers_[subscription].sequence++,
                  std::min(from_ns(static_cast<std::int64_t>(source_ns)), from_ns(e.at_ns)),
                  {}};
}

void TraceAssembler::hold(Thread& thread, std::uint32_t subscription,
                          const std::deque<Unread>::iterator& sample) {
  thread.taken_by = subscription;
  thread.taken = sample->sample;
  readers_[subscription].unread.erase(sample);
}

void TraceAssembler::enqueue(const TraceEvent& e) {
  const std::uint32_t subscription = subscription_behind(e.process, e.number[0]);
  Thread& thread = threads_[thread_index(e)];
  if (subscription != kNone && thread.topic == system_.callbacks[subscription].topic)
    deliver(e, subscription, thread, true);
}

void TraceAssembler::dequeue(const TraceEvent& e) {
  const std::uint32_t subscription = subscription_behind(e.process, e.number[0]);
  if (subscription == kNone || subscription >= readers_.size()) return;
  auto& unread = readers_[subscription].unread;
  const auto sample =
      std::ranges::find_if(unread, [&](const Unread& u) { return u.intra_process && u.slot == e.number[1]; });
  if (sample != unread.end()) hold(threads_[thread_index(e)], subscription, sample);
}

}  // namespace hotpath
