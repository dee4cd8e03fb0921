// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_executors.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::Duration, tracing::kNone;

/// Share of requests that a caller must explain, and of its jobs that must have sent one.
constexpr double kExplained = 0.9;

/// A request and the job that may have sent it: indices into the jobs.
using Match = std::pair<std::size_t, std::size_t>;

struct Caller {
  std::uint32_t callback = kNone;
  std::size_t jobs = 0;
  std::vector<Match> matches;
  Duration delays{};  ///< Sum from the ends of its jobs to the starts of the service's.
};

/// Each job of the service takes the latest job of the candidate that ended before it, unless an
/// earlier one has.
Caller matched(const std::vector<tracing::Job>& jobs, const std::vector<std::size_t>& served,
               const std::vector<std::size_t>& sent) {
  Caller caller;
  caller.jobs = sent.size();
  std::size_t next = 0;
  for (const std::size_t request : served) {
    const std::size_t first = next;
    while (next < sent.size() && jobs[sent[next]].finish <= jobs[request].start) ++next;
    if (next == first) continue;
    caller.matches.emplace_back(request, sent[next - 1]);
    caller.delays += jobs[request].start - jobs[sent[next - 1]].finish;
  }
  return caller;
}

bool explains(const Caller& caller, std::size_t requests) {
  const auto found = static_cast<double>(caller.matches.size());
  return found >= kExplained * static_cast<double>(requests) &&
         found >= kExplained * static_cast<double>(caller.jobs);
}

/// A rule that explains a smaller share of a node's jobs does not describe it.
constexpr double kDescribes = 0.95;

/// Callbacks of subscriptions are functions of this namespace.
constexpr const char* kSynchronisers = "message_filters";

}  // namespace

std::vector<std::string> attribute_requests(const tracing::System& system, std::vector<tracing::Job>& jobs) {
  std::map<std::uint32_t, std::set<std::uint32_t>> client_nodes;  // by service
  for (const tracing::ServiceClient& client : system.clients)
    if (client.node != kNone) client_nodes[client.service].insert(client.node);
  std::vector<std::vector<std::size_t>> jobs_of(system.callbacks.size());
  for (std::size_t j = 0; j < jobs.size(); ++j)
    if (jobs[j].ended && jobs[j].ref.callback < jobs_of.size()) jobs_of[jobs[j].ref.callback].push_back(j);
  std::vector<std::string> notes;
  for (std::uint32_t s = 0; s < system.callbacks.size(); ++s) {
    const tracing::Callback& service = system.callbacks[s];
    const auto nodes = client_nodes.find(service.topic);
    if (service.kind != tracing::CallbackKind::service || nodes == client_nodes.end() || jobs_of[s].empty())
      continue;
    Caller best;
    for (std::uint32_t c = 0; c < jobs_of.size(); ++c) {
      const std::uint32_t node = system.callbacks[c].node;
      if (c == s || node == kNone || !nodes->second.contains(node) || jobs_of[c].empty()) continue;
      Caller caller = matched(jobs, jobs_of[s], jobs_of[c]);
      caller.callback = c;
      if (!explains(caller, jobs_of[s].size())) continue;
      if (best.callback == kNone || caller.delays < best.delays) best = std::move(caller);
    }
    if (best.callback == kNone) continue;
    for (const auto& [request, sender] : best.matches) {
      tracing::Job& sent = jobs[sender];
      sent.published.push_back({service.topic, sent.finish, sent.finished});
      jobs[request].sample.published = sent.finish;
      jobs[request].sample.parent = sent.ref;
    }
    notes.push_back(program::concat("A trace does not show who calls a service: node ",
                                    system.nodes[system.callbacks[best.callback].node],
                                    " is taken to send the requests to ", system.topics[service.topic].name,
                                    ", which follow ", best.matches.size(), " of ", best.jobs,
                                    " jobs of one of its callbacks."));
  }
  return notes;
}

std::vector<std::string> unseen_callbacks(const tracing::System& system,
                                          const std::vector<RecordedExecutor>& executors) {
  const auto waits = [&](std::uint32_t thread) { return system.threads[thread].waits > 0; };
  const auto is_unseen = [&](const RecordedExecutor& executor) {
    const auto states_ends = [&](const tracing::StatedExecutor& stated) {
      return stated.states_ends && executor.is(stated);
    };
    return std::ranges::count(system.clients, executor.process, &tracing::ServiceClient::process) > 0 &&
           std::ranges::none_of(executor.threads, waits) &&
           std::ranges::none_of(system.stated_executors, states_ends);
  };
  std::vector<std::string> notes;
  if (std::ranges::any_of(executors, is_unseen)) {
    notes.push_back(
        "An executor writes no events of callbacks of clients, actions and other waitables; what they ran is "
        "missing in the graph.");
  }
  if (system.unclear_callbacks > 0 && !system.clients.empty()) {
    notes.push_back(
        "Several threads of a process wait for work: callbacks of clients and waitables, which have no "
        "events, cannot be told from waiting for another thread and are missing in the graph.");
  }
  return notes;
}

std::vector<std::string> unmodelled(const tracing::System& system, const RecordedGraph& graph) {
  std::map<std::uint32_t, std::vector<std::string>> filtered;  // topics by node
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c) {
    const tracing::Callback& callback = system.callbacks[c];
    const bool filters = callback.symbol.find(kSynchronisers) != std::string::npos;
    if (graph.task_of[c] != kNoTask && filters)
      filtered[callback.node].push_back(system.topics[callback.topic].name);
  }
  std::vector<std::string> all;
  all.reserve(filtered.size() + graph.rules.size());
  for (const auto& [node, topics] : filtered) {
    all.push_back(program::concat(
        "Node ", system.nodes[node], " passes ", program::joined(topics, ", "),
        " through message_filters, which is not modelled: a synchroniser may hold messages until "
        "later ones arrive, and the graph publishes as soon as its rule allows."));
  }
  for (const InferredRule& rule : graph.rules) {
    if (static_cast<double>(rule.explained) >= kDescribes * static_cast<double>(rule.jobs)) continue;
    all.push_back(program::concat(
        "No rule of publication describes topic ", system.topics[rule.topic].name, ": the best one explains ",
        rule.explained, " of ", rule.jobs, " jobs of ",
        system.nodes[system.callbacks[rule.publishers.front()].node],
        ". A lifecycle node publishes only while it is active; other nodes decide by content."));
  }
  return all;
}

}  // namespace hotpath::imports
