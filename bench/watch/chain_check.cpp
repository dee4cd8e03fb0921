// SPDX-License-Identifier: Apache-2.0
#include "watch/chain_check.hpp"

#include <algorithm>
#include <set>
#include <tuple>

namespace hotpath::watch {

namespace {

/// The inputs that enter messages; callbacks of a node that publish by the same set share its samples.
std::vector<imports::HeldInputs> held_inputs(const Contract& contract, const StatedNames& names) {
  std::map<std::tuple<std::string, std::uint32_t, std::vector<std::string>>, imports::HeldInputs> held;
  for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
    const CallbackContract& callback = contract.callbacks[c];
    for (const StatedPublication& p : callback.publishes)
      if (!p.with.empty()) held[{callback.node, names.number_of(p.topic), p.with}].publishers.push_back(c);
  }
  std::vector<imports::HeldInputs> rules;
  for (auto& [key, inputs] : held) {
    const auto& [node, topic, with] = key;
    inputs.topic = topic;
    for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
      const CallbackContract& callback = contract.callbacks[c];
      if (callback.node == node && std::ranges::count(with, callback.topic) > 0) inputs.of.push_back(c);
    }
    rules.push_back(std::move(inputs));
  }
  return rules;
}

/// By callback: the callbacks whose messages have the data of its messages: the subscriptions that take
/// them, and callbacks of their nodes that publish `with` them.
std::vector<std::vector<TaskId>> next_of(const Contract& contract,
                                         const std::vector<imports::HeldInputs>& held) {
  std::vector<std::vector<TaskId>> next(contract.callbacks.size());
  for (TaskId reader = 0; reader < next.size(); ++reader) {
    std::set<TaskId> with = {reader};
    for (const imports::HeldInputs& inputs : held)
      if (std::ranges::count(inputs.of, reader) > 0)
        with.insert(inputs.publishers.begin(), inputs.publishers.end());
    for (TaskId from = 0; from < next.size(); ++from)
      if (contract.callbacks[from].may_publish(contract.callbacks[reader].topic))
        next[from].insert(next[from].end(), with.begin(), with.end());
  }
  return next;
}

}  // namespace

ChainCheck::ChainCheck(const Contract& contract, const StatedNames& names, Judge& judge)
    : contract_(contract),
      judge_(judge),
      jobs_(contract.callbacks.size()),
      observed_(contract.chains.size()),
      follower_(follower(names)) {}

imports::ChainFollower ChainCheck::follower(const StatedNames& names) {
  std::vector<ChainIndex> chains;
  for (const ChainContract& chain : contract_.chains) {
    ChainIndex& index = chains.emplace_back();
    index.sources.assign(chain.sources.begin(), chain.sources.end());
    index.sink_tasks.assign(chain.sinks.begin(), chain.sinks.end());
    for (const std::uint32_t source : chain.sources) source_jobs_[source];
  }
  std::vector<std::size_t> unread(names.topics().size());
  std::vector<bool> publishing;
  for (const CallbackContract& callback : contract_.callbacks) {
    publishing.push_back(!callback.publishes.empty());
    const std::uint32_t topic = taken_.emplace_back(names.number_of(callback.topic));
    const Term* const depth = find(callback.terms, Clause::depth);
    const std::int64_t samples = depth ? depth->limit : 0;
    const std::size_t most = imports::ChainFollower::most_unread(static_cast<std::uint32_t>(samples));
    if (topic != tracing::kNone) unread[topic] = std::max(unread[topic], most);
  }
  std::vector<imports::HeldInputs> held = held_inputs(contract_, names);
  ChainLanes lanes(chains, next_of(contract_, held));
  return {std::move(chains), std::move(held),
          std::move(unread), std::move(publishing),
          std::move(lanes),  [this](const ChainObservation& o) { pending_.push_back(o); }};
}

void ChainCheck::started(std::uint32_t entry, const tracing::Job& job, std::uint32_t publisher,
                         std::optional<Time> timestamp) {
  const std::uint64_t number = jobs_[entry]++;
  if (const auto source = source_jobs_.find(entry); source != source_jobs_.end()) {
    source->second.push_back(timestamp);
    if (source->second.size() > kRemembered) source->second.pop_front();
  }
  std::optional<imports::ChainFollower::Taken> taken;
  if (publisher != tracing::kNone && taken_[entry] != tracing::kNone)
    taken = {job.sample.parent, publisher, taken_[entry]};
  follower_.start(job.ref, {entry, number}, job.start, taken);
}

void ChainCheck::ended(const tracing::Job& job, bool judged) {
  const std::optional<JobRef> ref = follower_.end(job.ref, job.ended);
  std::erase_if(pending_, [&](const ChainObservation& output) {
    const bool of_job = ref && output.sink == *ref;
    if (of_job && job.ended) end(output, job, judged);
    return of_job;
  });
}

void ChainCheck::end(const ChainObservation& output, const tracing::Job& sink, bool judged) {
  ObservedChain& observed = observed_[output.chain];
  Subject& chain = judge_.all(Kind::chain)[output.chain];
  const Duration hot_path = output.sink_start - output.latest_source_start;
  observed.hot_path.add(hot_path);
  if (judged) {
    chain.seen = true;
    chain.compare(Clause::hot_path, hot_path.count(), output.sink_start);
  }
  const std::optional<Time> oldest = oldest_source(output);
  if (!oldest) return;
  const Duration age = sink.finish - *oldest;
  observed.age.add(age);
  if (!judged) return;
  chain.compare(Clause::age, age.count(), sink.finish);
  chain.compare(Clause::requirement, age.count(), sink.finish);
}

/// The timestamp of its job; std::nullopt: unknown.
std::optional<Time> ChainCheck::oldest_source(const ChainObservation& output) const {
  std::optional<Time> oldest;
  const std::vector<std::uint32_t>& sources = contract_.chains[output.chain].sources;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (((output.sources_seen >> s) & 1U) == 0) continue;
    const std::deque<std::optional<Time>>& latest = source_jobs_.at(sources[s]);
    const std::uint64_t first = jobs_[sources[s]] - latest.size(), number = output.source_sequence[s];
    if (number < first || number - first >= latest.size() || !latest[number - first]) return std::nullopt;
    oldest = std::min(oldest.value_or(Time::max()), *latest[number - first]);
  }
  return oldest;
}

}  // namespace hotpath::watch
