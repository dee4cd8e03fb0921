// SPDX-License-Identifier: Apache-2.0
// What has not happened: lasting jobs, silence, and callbacks and processes that do not run.
#include <algorithm>
#include <tuple>
#include <utility>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"
#include "watch/observer.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

namespace {

/// A longer absence of jobs or samples is silence: what arrives late is known late.
Duration patience(const JudgedTerm& distance) {
  const Duration limit(distance.term().limit);
  return limit + std::min<Duration>(limit, std::chrono::seconds(1));
}

/// Whether events show that it runs: not of clients and actions, nor of what an import adds or never saw.
bool has_events(const CallbackContract& stated) {
  return stated.node != imports::kOutside && !stated.topic.ends_with("/response") &&
         stated.topic.find("/_action/") == std::string::npos &&
         std::ranges::any_of(stated.terms, [](const Term& t) { return t.clause != Clause::publishes; });
}

}  // namespace

void Observer::note_losses(std::uint64_t losses, Time until) {
  if (losses == losses_) return;
  losses_ = losses;
  lost_at_ = until;
  lossless_ = false;
}

void Observer::observed_until(Time until, std::uint64_t losses) {
  constexpr auto kPause = std::chrono::milliseconds(100);
  constexpr auto kDoubt = std::chrono::seconds(5);
  note_losses(losses, until);
  lossless_ = !ending_ && (!lost_at_ || until > *lost_at_ + kDoubt);
  if (observed_until_ && until < *observed_until_ + kPause) return;
  observed_until_ = until;
  begin_ = begin_.value_or(until);
  judge_processes(until);
  if (lossless_) judge_standing(until);
  judge_created_publishers(until);
  judge_running(until);
  for (std::uint32_t entry = 0; lossless_ && entry < states_.size(); ++entry) judge_silence(entry, until);
}

void Observer::judge_running(Time until) {
  for (RunningJob& job : running_.all()) {
    const std::uint32_t entry = names_.entry_of(job.ref.callback);
    JudgedTerm* const budget = entry == kNone ? nullptr : judge_.callback(entry).find(Clause::budget);
    if (budget == nullptr || job.overdue || is_doubtful(job.start)) continue;
    const std::optional<Time> start = running_.undisplaced_start(job);
    if (!start || (until - *start).count() <= budget->term().limit) continue;
    job.overdue = start;
    job.judged = until - *start;
    budget->judge_lasting(*start, until);
  }
}

void Observer::judge_silence(std::uint32_t entry, Time until) {
  CallbackState& state = states_[entry];
  JudgedTerm* const distance = judge_.callback(entry).find(Clause::maximum_distance);
  if (distance == nullptr || !state.last || state.silent) return;
  // Samples wait unread while another callback runs, and those of unwatched publishers are known only when
  // they are taken: only what nothing can explain is silence.
  const Time since = std::max(*state.last, system().callbacks[state.callback].published_for_it);
  if (until - since <= patience(*distance)) return;
  state.silent = until;
  state.silent_since = since;
  distance->judge_lasting(since, until);
}

void Observer::forget(const ThreadKey& ended, bool broke_off) {
  thread_check_.forget(ended);
  if (ended.second != 0) {
    assembler_.forget_thread(ended.first, ended.second);
    timestamps_.forget(ended);
    return;
  }
  assembler_.forget_process(ended.first);
  const auto process = processes_.find(ended.first);
  if (process == processes_.end() || process->second.ended) return;
  process->second.ended = observed_until_.value_or(process->second.finish);
  process->second.broke_off = broke_off;
}

/// Processes that have ended while others go on. At the end of a run, they end one after another, the last
/// ones by themselves.
void Observer::judge_processes(Time until) {
  constexpr auto kEnding = std::chrono::milliseconds(1500);
  std::erase_if(processes_, [&](const auto& known) {
    const auto& [id, process] = known;
    if (ending_ || !process.ended || until < *process.ended + kEnding) return false;
    const bool others = std::ranges::any_of(processes_, [](const auto& p) { return !p.second.ended; });
    if (!others && !process.broke_off) return true;
    const bool one = process.nodes.size() == 1;
    judge_.incidents().add(
        {Role::gone, process.finish,
         program::concat(one ? "node " : "nodes ", program::joined(process.nodes, ", "),
                         one ? " is gone: its process " : " are gone: their process ", id, " has ended")});
    return true;
  });
}

/// Callbacks that do not run, although others of the contract do.
void Observer::judge_standing(Time until) {
  if (!names_.kept()) return;
  if (std::exchange(nodes_, system().nodes.size()) != system().nodes.size()) grown_ = until;
  std::vector<std::uint32_t> callbacks(states_.size(), kNone);  // the latest, by entry
  for (std::uint32_t c = 0; c < system().callbacks.size(); ++c)
    if (const std::uint32_t entry = names_.entry_of(c); entry != kNone) callbacks[entry] = c;
  for (std::uint32_t entry = 0; entry < states_.size(); ++entry)
    if (!states_[entry].stands) judge_standing(entry, callbacks[entry], until);
}

void Observer::judge_standing(std::uint32_t entry, std::uint32_t c, Time until) {
  constexpr Duration kDoubt = std::chrono::milliseconds(500), kDiscovery = std::chrono::milliseconds(1700),
                     kStart = std::chrono::seconds(10);
  if (!has_events(contract_.callbacks[entry])) return;
  const bool seen = judge_.callback(entry).seen;
  CallbackState& state = states_[entry];
  JudgedTerm* const distance = judge_.callback(entry).find(Clause::maximum_distance);
  const tracing::Callback none{}, &callback = c == kNone ? none : system().callbacks[c];
  if (!state.waited_for && callback.published_for_it > state.last.value_or(Time{}))
    state.waited_for = callback.published_for_it;
  const bool unread = state.waited_for && callback.published_for_it > *state.waited_for;
  // The description of what is missing may be among lost events.
  if (seen         ? !unread || !could_run(callback, *state.waited_for)
      : c == kNone ? lost_at_.has_value()
                   : !unread && !distance)
    return;
  const bool timer = callback.kind == CallbackKind::timer;
  const Time since = unread  ? *state.waited_for
                     : timer ? std::max({callback.created + callback.period, *begin_, grown_})
                             : std::max(*begin_, grown_);
  Duration limit = kStart;
  if (distance && (seen || (timer && runs(entry))))
    limit = patience(*distance) + kDoubt;
  else if (distance && runs(entry))
    limit = Duration(distance->term().limit) + kDiscovery;
  const Time latest = unread && !distance ? callback.published_for_it : until;  // it came late to old samples
  if (latest - since <= limit) return;
  state.stands = true;
  const std::string name = judge_.callback(entry).name;
  Fact fact{Role::never_runs,
            since,
            name + " has not run for " + shown_ms(until - since) + ", although samples were published",
            distance,
            since,
            until};
  if (!seen) std::tie(fact.role, fact.sentence) = absence(entry, c);
  if (!distance) return judge_.incidents().add(std::move(fact));
  fact.at += Duration(distance->term().limit);
  distance->observe((until - since).count());
  distance->fail(std::move(fact));
}

/// Whether a thread of the subscription neither stands nor has run one job since then.
bool Observer::could_run(const tracing::Callback& callback, Time since) const {
  return std::ranges::any_of(callback.threads, [&](const auto& jobs) {
    const std::uint32_t thread = jobs.first;
    return !thread_check_.stands(key_of(system().threads[thread])) &&
           std::ranges::none_of(running_.all(), [&](const RunningJob& job) {
             return job.thread == thread && job.start <= since;
           });
  });
}

/// The nodes of the system that stand for the entry's.
std::vector<std::uint32_t> Observer::nodes_of(std::uint32_t entry) const {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t node = 0; node < system().nodes.size(); ++node)
    if (names_.stated_node(node) == contract_.callbacks[entry].node) nodes.push_back(node);
  return nodes;
}

/// Whether the process of the entry's node runs callbacks of the contract.
bool Observer::runs(std::uint32_t entry) const {
  const std::vector<std::uint32_t> nodes = nodes_of(entry);
  return std::ranges::any_of(system().endpoints, [&](const tracing::Endpoint& e) {
    const std::uint32_t node = e.callback == kNone ? e.node : system().callbacks[e.callback].node;
    return std::ranges::count(nodes, node) > 0 && processes_.contains(e.process);
  });
}

/// What is known of a callback that has never run, `c` of the system.
std::pair<Role, std::string> Observer::absence(std::uint32_t entry, std::uint32_t c) {
  const CallbackContract& stated = contract_.callbacks[entry];
  const std::vector<std::uint32_t> nodes = nodes_of(entry);
  if (nodes.empty())
    return {Role::gone,
            "node " + stated.node + " is not there, or not watched: " + stated.name() + " has never run"};
  const std::string sentence = stated.name() + " has never run";
  const bool subscription = !stated.topic.empty() && !stated.service;
  if (c != kNone) {
    const std::uint64_t samples = system().callbacks[c].samples;
    if (!subscription) return {Role::never_runs, sentence};
    if (samples == 0) return {Role::never_runs, sentence + ": nothing was published for it"};
    return {Role::never_runs, program::concat(sentence, ", although ", samples,
                                              " samples were published, as if QoS settings did not match")};
  }
  std::string instead;
  for (std::uint32_t o = 0; subscription && o < system().callbacks.size(); ++o) {
    const tracing::Callback& other = system().callbacks[o];
    if (other.kind != CallbackKind::subscription || other.topic == kNone ||
        std::ranges::count(nodes, other.node) == 0 || names_.entry_of(o) != kNone ||
        imports::is_housekeeping(system().topics[other.topic].name))
      continue;
    instead += (instead.empty() ? ", but subscribes to " : ", ") + system().topics[other.topic].name;
  }
  return {Role::never_runs, sentence + ": its node has no such callback" + instead};
}

void Observer::judge_created_publishers(Time until) {
  judged_endpoints_.resize(system().endpoints.size());
  for (std::size_t e = 0; names_.kept() && e < system().endpoints.size(); ++e) {
    const tracing::Endpoint& endpoint = system().endpoints[e];
    if (judged_endpoints_[e] || endpoint.kind != tracing::Endpoint::Kind::publisher ||
        endpoint.topic == kNone)
      continue;
    judged_endpoints_[e] = true;
    const std::uint32_t topic = names_.number_of(endpoint.topic);
    if (topic == kNone) continue;
    judge_.all(Kind::topic)[topic].seen = true;
    judge_publisher(topic, names_.may_publish(endpoint.node, topic),
                    "has a publisher of " + node_name(system(), endpoint.node) + ", which the contract lacks",
                    until);
  }
}

}  // namespace hotpath::watch
