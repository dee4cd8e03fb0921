// SPDX-License-Identifier: Apache-2.0
// Callbacks of clients and waitables, of which rclcpp writes no events. An executor with a wait set
// announces each question for the next callback: if it asks again without having waited, and
// nothing was announced in between, it ran such a callback; if it took a sample for an action's
// client, that subscription's. A PriorityExecutor states the job.
#include <algorithm>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath::tracing {

namespace {

constexpr const char* kPseudoNode = "/clients_and_waitables";

}  // namespace

void Assembler::on_client_init(const Event& e) {
  endpoint(e, Endpoint::Kind::client, 0);
  if (*e.text[0] == '\0') return;
  const auto index = static_cast<std::uint32_t>(system_.clients.size());
  const std::uint32_t service = topic_named(e.text[0], true);
  clients_[{e.process, e.number[0]}] = index;
  clients_of_[service].push_back(index);
  system_.clients.push_back({e.process, find(nodes_, {e.process, e.number[1]}, kNone), service,
                             topic_named(e.text[0] + std::string("/response"), true), kNone});
}

/// A wait-set executor asks for the next callback.
void Assembler::on_get_next_ready(const Event& e) {
  ThreadState& thread = thread_of(e);
  thread.waits = false;
  const bool is_long = thread.open.empty() && thread.asked && e.at - *thread.asked > kLeastUnannounced;
  if (is_long && !thread.unannounced) {
    // Threads that share a wait set wait for each other: it may have run nothing.
    if (waiting_threads_[e.process] > 1 + thread.apart.size()) {
      ++system_.unclear_callbacks;
      static_cast<void>(take_response(e.process, kNone, thread.apart));
    } else {
      begin_unannounced(e, thread);
    }
  }
  announce(e);
  if (!thread.open.empty()) return;  // a callback that spins
  thread.asked = thread.question = e.at;
  thread.asked_at = events_;
}

/// The mutex of an executor with several threads lets one of them wait at a time.
void Assembler::on_wait_for_work(const Event& e) {
  announce(e);
  ThreadState& thread = thread_of(e);
  thread.waited = thread.waits = true;
  const bool is_new = system_.threads[thread.index].waits++ == 0;
  if (is_new) ++waiting_threads_[e.process];
  if (waiting_threads_[e.process] == 1 + thread.apart.size()) return;
  for (ThreadState& other : threads_) {
    if (!other.waits || other.index == thread.index || system_.threads[other.index].process != e.process)
      continue;
    other.apart.insert(thread.index);
    thread.apart.insert(other.index);
  }
}

/// Ends the thread's unannounced job, if there is one.
void Assembler::announce(const Event& e) {
  ThreadState& thread = thread_of(e);
  thread.asked.reset();
  if (!thread.unannounced || thread.open.empty()) return;
  thread.unannounced = false;
  give_up(thread.open, 1);
  close(e, thread);
}

void Assembler::on_execute(const Event& e) { announce(e); }

/// Begins a job at the thread's last question.
void Assembler::begin_unannounced(const Event& e, ThreadState& thread) {
  const std::optional<Response> response = take_response(e.process, kNone, thread.apart);
  std::uint32_t& other = thread.unannounced_callback;
  if (!response && other == kNone)
    other = unannounced_callback(pseudo_node(e.process), "thread_" + std::to_string(e.thread));
  begin_unannounced(thread, response ? client_callback(response->client) : other, *thread.asked,
                    thread.asked_at, response);
}

void Assembler::begin_unannounced(ThreadState& thread, std::uint32_t callback, Time at, std::uint64_t event,
                                  std::optional<Response> response) {
  Job& job = thread.open.emplace_back();
  thread.unannounced = true;
  job.ref = {callback, callback_states_[callback].jobs++};
  job.thread = thread.index;
  job.start = at;
  job.started = event;
  job.waited = std::exchange(thread.waited, false);
  job.timestamp = std::exchange(thread.timestamp, {});
  job.release = std::exchange(thread.release, {});
  job.has_sample = true;
  if (thread.taken_by == callback) {
    thread.taken_by = kNone;
    job.sample = thread.taken;
    return;
  }
  const Time arrival = job.timestamp > Time{} ? std::min(job.timestamp, at) : at;
  job.sample = stranger(callback, response ? std::min(response->at, at) : arrival);
  if (!response) return;
  job.sample.parent = response->parent;
  --system_.callbacks[callback].strangers;
}

std::uint32_t Assembler::client_callback(std::uint32_t client) {
  ServiceClient& of = system_.clients[client];
  if (of.callback != kNone) return of.callback;
  of.callback = add_callback(CallbackKind::client);
  Callback& callback = system_.callbacks[of.callback];
  callback.node = of.node;
  callback.topic = of.response;
  callback.depth = kServiceDepth;
  return of.callback;
}

/// The node of all unannounced callbacks of a process whose nodes are not known.
std::uint32_t Assembler::pseudo_node(std::uint32_t process) {
  const auto [at, is_new] =
      pseudo_nodes_.try_emplace(process, static_cast<std::uint32_t>(system_.nodes.size()));
  if (!is_new) return at->second;
  const bool first = pseudo_nodes_.size() == 1;
  system_.nodes.push_back(kPseudoNode + (first ? std::string() : "_" + std::to_string(process)));
  return at->second;
}

/// The callback that stands for all unannounced ones of a node or of a thread.
std::uint32_t Assembler::unannounced_callback(std::uint32_t node, const std::string& topic) {
  const std::uint32_t named = topic_named(system_.nodes[node] + "/" + topic, true);
  const auto [at, is_new] = unannounced_.try_emplace(named, kNone);
  if (!is_new) return at->second;
  at->second = add_callback(CallbackKind::unannounced);
  system_.callbacks[at->second].node = node;
  system_.callbacks[at->second].topic = named;
  system_.callbacks[at->second].depth = kServiceDepth;
  return at->second;
}

/// A service has answered: its only client will run its response.
void Assembler::respond(const Event& e, Job& job) {
  const Callback& service = system_.callbacks[job.ref.callback];
  const auto clients = clients_of_.find(service.topic);
  if (clients == clients_of_.end() || clients->second.size() != 1) return;
  const ServiceClient& client = system_.clients[clients->second.front()];
  job.published.push_back({client.response, e.at, events_});
  std::deque<Response>& waiting = responses_[client.process];
  waiting.push_back({clients->second.front(), e.at, job.ref});
  if (waiting.size() > kServiceDepth) waiting.pop_front();
}

/// The oldest response for a process, or for one of its clients, but not for nodes of the threads `apart`.
/// Wait sets serve clients before waitables.
std::optional<Assembler::Response> Assembler::take_response(std::uint32_t process, std::uint32_t client,
                                                            const std::set<std::uint32_t>& apart) {
  std::deque<Response>& waiting = responses_[process];
  const auto is_apart = [&](const auto& jobs) { return apart.contains(jobs.first); };
  const auto matches = [&](const Response& r) {
    return (client == kNone || r.client == client) &&
           std::ranges::none_of(system_.callbacks, [&](const Callback& c) {
             return c.node == system_.clients[r.client].node && std::ranges::any_of(c.threads, is_apart);
           });
  };
  const auto first = std::ranges::find_if(waiting, matches);
  if (first == waiting.end()) return std::nullopt;
  const Response response = *first;
  waiting.erase(first);
  return response;
}

}  // namespace hotpath::tracing
