// SPDX-License-Identifier: Apache-2.0
#include "import/trace_assembler.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace hotpath {

namespace {

/// Unread samples of a subscription that keeps all.
constexpr std::size_t kKeepAll = 1000;
/// A thread has at most so many callbacks within each other, as when one spins.
constexpr std::size_t kMostNested = 16;

}  // namespace

void TraceAssembler::visit(const TraceEvent& e) {
  const Handle first{e.process, e.number[0]};
  using K = TraceEventKind;
  switch (e.kind) {
    case K::rcl_init:
      system_.rcl_version = e.text[0];
      return;
    case K::node_init:
      return node(e);
    case K::publisher_init:
      return publisher(e);
    case K::subscription_init:
      return subscription(e);
    case K::rclcpp_subscription_init:
      rclcpp_subscriptions_[{e.process, e.number[1]}] = first;
      return;
    case K::subscription_callback_added: {
      const auto rcl = rclcpp_subscriptions_.find(first);
      const auto known =
          rcl == rclcpp_subscriptions_.end() ? subscriptions_.end() : subscriptions_.find(rcl->second);
      if (known != subscriptions_.end()) add_callback({e.process, e.number[1]}, known->second);
      return;
    }
    case K::timer_init:
      timers_[first] = {Duration(static_cast<std::int64_t>(e.number[1])), from_ns(e.at_ns), kNone};
      return;
    case K::timer_callback_added:
      return timer_callback(e);
    case K::timer_link_node: {
      const auto timer = timers_.find(first);
      if (timer != timers_.end() && timer->second.callback != kNone)
        system_.callbacks[timer->second.callback].node = node_of({e.process, e.number[1]});
      return;
    }
    case K::service_callback_added: {
      RecordedCallback& service = system_.callbacks.emplace_back();
      service.kind = RecordedKind::service;
      return add_callback({e.process, e.number[1]}, static_cast<std::uint32_t>(system_.callbacks.size() - 1));
    }
    case K::callback_start:
      return start(e);
    case K::callback_end:
      return end(e);
    case K::rcl_publish:
      return publish(e, false);
    case K::intra_publish:
      return publish(e, true);
    case K::rmw_publish:
      return stamp(e);
    case K::rmw_take:
      return take(e);
    case K::buffer_to_ipb:
      ipb_of_buffer_[first] = e.number[1];
      return;
    case K::ipb_to_subscription:
      subscription_of_ipb_[first] = e.number[1];
      return;
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
    case K::other:
      return;
  }
}

void TraceAssembler::node(const TraceEvent& e) {
  std::string name(e.text[1]);
  if (!name.ends_with('/')) name += '/';
  name += e.text[0];
  nodes_[{e.process, e.number[0]}] = static_cast<std::uint32_t>(system_.nodes.size());
  system_.nodes.push_back({e.process, std::move(name)});
  system_.processes.try_emplace(e.process, e.process_name);
}

void TraceAssembler::publisher(const TraceEvent& e) {
  const Publisher made{node_of({e.process, e.number[1]}), topic_named(e.text[0])};
  publishers_[{e.process, e.number[0]}] = made;
  if (made.node != kNone) system_.topics[made.topic].publishers.insert(made.node);
}

void TraceAssembler::subscription(const TraceEvent& e) {
  const auto index = static_cast<std::uint32_t>(system_.callbacks.size());
  RecordedCallback& made = system_.callbacks.emplace_back();
  made.kind = RecordedKind::subscription;
  made.node = node_of({e.process, e.number[1]});
  made.topic = topic_named(e.text[0]);
  made.depth = static_cast<std::uint32_t>(std::min<std::uint64_t>(e.number[3], kKeepAll));
  system_.topics[made.topic].subscriptions.push_back(index);
  subscriptions_[{e.process, e.number[0]}] = index;
  rmw_subscriptions_[{e.process, e.number[2]}] = index;
}

void TraceAssembler::timer_callback(const TraceEvent& e) {
  Timer& timer = timers_[{e.process, e.number[0]}];
  if (timer.period <= Duration::zero()) return;
  timer.callback = static_cast<std::uint32_t>(system_.callbacks.size());
  RecordedCallback& made = system_.callbacks.emplace_back();
  made.kind = RecordedKind::timer;
  made.period = timer.period;
  made.created = timer.created;
  add_callback({e.process, e.number[1]}, timer.callback);
}

void TraceAssembler::add_callback(Handle callback, std::uint32_t index) {
  const auto [at, is_new] = callbacks_.try_emplace(callback, index);
  if (is_new || at->second == index) return;
  at->second = index;
  ++system_.reused_handles;
}

void TraceAssembler::start(const TraceEvent& e) {
  const auto [at, is_new] =
      callbacks_.try_emplace({e.process, e.number[0]}, static_cast<std::uint32_t>(system_.callbacks.size()));
  if (is_new) system_.callbacks.emplace_back();
  const std::uint32_t callback = at->second;
  numbers_.resize(std::max(numbers_.size(), system_.callbacks.size()));
  const std::uint32_t index = thread_index(e);
  Thread& thread = threads_[index];
  // A callback cannot be within itself: its end was lost.
  const auto same = [&](const RecordedJob& job) { return job.ref.callback == callback; };
  if (std::ranges::any_of(thread.open, same) || thread.open.size() == kMostNested) {
    for (RecordedJob& job : thread.open) give_up(job);
    thread.open.clear();
  }
  RecordedJob& job = thread.open.emplace_back();
  job.ref = {callback, numbers_[callback]++};
  job.thread = index;
  job.start = from_ns(e.at_ns);
  job.waited = std::exchange(thread.waited, false);
  if (thread.taken_by == callback) {
    job.has_sample = true;
    job.sample = thread.taken;
  } else if (RecordedCallback& c = system_.callbacks[callback]; c.kind == RecordedKind::subscription) {
    readers_.resize(std::max(readers_.size(), system_.callbacks.size()));
    auto& unread = readers_[callback].unread;
    // Without an event of its take (Humble within a process) the oldest unread sample is what it has.
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
  const auto found = std::ranges::find_if(thread.open, matches);
  if (found == thread.open.end()) {
    ++system_.ends_without_start;
    return;
  }
  for (auto inner = std::next(found); inner != thread.open.end(); ++inner) give_up(*inner);
  RecordedJob job = std::move(*found);
  thread.open.erase(found, thread.open.end());
  job.finish = from_ns(e.at_ns);
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

void TraceAssembler::publish(const TraceEvent& e, bool intra_process) {
  const auto known = publishers_.find({e.process, e.number[0]});
  if (known == publishers_.end()) return;
  Thread& thread = threads_[thread_index(e)];
  // A call of publish() that serves both is one publication: first within the process, then between them.
  const bool continued = !intra_process && thread.intra_published && thread.publisher == e.number[0];
  thread.intra_published = intra_process;
  thread.message = e.number[1];
  if (!continued) {
    thread.publisher = e.number[0];
    thread.publication = ++publications_;
    thread.topic = known->second.topic;
    RecordedTopic& topic = system_.topics[thread.topic];
    ++topic.published;
    if (thread.open.empty()) {
      ++topic.outside;
    } else {
      thread.open.back().published.push_back({thread.topic, from_ns(e.at_ns)});
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
  const bool has_it = !readers.unread.empty() && readers.unread.back().publication == thread.publication;
  if (has_it) return;
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

/// The timestamp that readers will see.
void TraceAssembler::stamp(const TraceEvent& e) {
  const Thread& thread = threads_[thread_index(e)];
  if (thread.topic == kNone || thread.message != e.number[0] || e.number[1] == 0) return;
  for (const std::uint32_t subscription : system_.topics[thread.topic].subscriptions) {
    if (subscription >= readers_.size() || readers_[subscription].unread.empty()) continue;
    Unread& unread = readers_[subscription].unread.back();
    if (unread.publication == thread.publication) unread.source_ns = e.number[1];
  }
}

void TraceAssembler::take(const TraceEvent& e) {
  const auto known = rmw_subscriptions_.find({e.process, e.number[0]});
  if (known == rmw_subscriptions_.end() || e.number[2] == 0) return;
  const std::uint32_t subscription = known->second;
  readers_.resize(std::max(readers_.size(), system_.callbacks.size()));
  auto& unread = readers_[subscription].unread;
  const std::uint64_t source_ns = e.number[1];
  auto found = std::ranges::find(unread, source_ns, &Unread::source_ns);
  if (found == unread.end()) {
    // Humble's publications have no timestamps: the middleware's follows their event at once.
    const auto distance = [&](const Unread& u) {
      return std::abs(static_cast<std::int64_t>(source_ns) - to_ns(u.sample.published));
    };
    const auto nearest = std::ranges::min_element(unread, {}, distance);
    const bool near = nearest != unread.end() && nearest->source_ns == 0 && distance(*nearest) < 1'000'000;
    if (near) found = nearest;
  }
  Thread& thread = threads_[thread_index(e)];
  if (found != unread.end()) return hold(thread, subscription, found);
  ++system_.callbacks[subscription].strangers;
  ++system_.callbacks[subscription].samples;
  thread.taken_by = subscription;
  thread.taken = {readers_[subscription].sequence++,
                  std::min(from_ns(static_cast<std::int64_t>(source_ns)), from_ns(e.at_ns)),
                  {}};
}

void TraceAssembler::hold(Thread& thread, std::uint32_t subscription, std::deque<Unread>::iterator found) {
  thread.taken_by = subscription;
  thread.taken = found->sample;
  readers_[subscription].unread.erase(found);
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
  const auto found =
      std::ranges::find_if(unread, [&](const Unread& u) { return u.intra_process && u.slot == e.number[1]; });
  if (found != unread.end()) hold(threads_[thread_index(e)], subscription, found);
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

std::uint32_t TraceAssembler::node_of(Handle handle) const {
  const auto found = nodes_.find(handle);
  return found == nodes_.end() ? kNone : found->second;
}

std::uint32_t TraceAssembler::topic_named(std::string_view name) {
  const auto [at, is_new] =
      topics_.try_emplace(std::string(name), static_cast<std::uint32_t>(system_.topics.size()));
  if (is_new) system_.topics.emplace_back().name = name;
  return at->second;
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

std::uint32_t TraceAssembler::subscription_behind(std::uint32_t process, std::uint64_t buffer) const {
  const auto ipb = ipb_of_buffer_.find({process, buffer});
  if (ipb == ipb_of_buffer_.end()) return kNone;
  const auto rclcpp = subscription_of_ipb_.find({process, ipb->second});
  if (rclcpp == subscription_of_ipb_.end()) return kNone;
  const auto rcl = rclcpp_subscriptions_.find({process, rclcpp->second});
  if (rcl == rclcpp_subscriptions_.end()) return kNone;
  const auto found = subscriptions_.find(rcl->second);
  return found == subscriptions_.end() ? kNone : found->second;
}

}  // namespace hotpath
